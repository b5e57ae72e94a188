"""Disparity between the steps of a sweep: least squares on the differences of views (Lucas and Kanade, IJCAI 1981),
smooth in its second derivative, so that slants stay slants, where neither the picture nor the map has an edge.
"""

from __future__ import annotations

import numpy as np

from iibr_core.depth.multi_view.matching import STEP_PX, MatchingViews
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.types import FloatImage, image_size

REFINEMENT_ROUNDS = 2
UNLIKE = 0.02
"""Differences of texture (1 = white) from which on a view counts as hidden there (Geman and McClure's weights)."""
SMOOTHNESS = 1e-2
EDGE_LUMA = 0.05
"""Edges of the picture this strong let a third of the smoothness through."""
EDGE_DISPARITY = 0.1
"""Bends of the map (px per view step) that count as edges."""
SOLVER_STEPS = 40
LITTLE = np.float32(1e-7)


def refine_by_gradients(views: MatchingViews, disparity: FloatImage) -> FloatImage:
    """The disparity (H, W) of the reference, moved between the steps of a sweep, never far."""
    size = image_size(disparity)
    longest = np.float32(STEP_PX / max(views.reach, 1e-6))
    curvature, pull = np.empty(size, np.float32), np.empty(size, np.float32)
    for _ in range(REFINEMENT_ROUNDS):
        _measure_all(views, disparity, curvature, pull)
        target = disparity + np.clip(-pull / (curvature + LITTLE), -longest, longest)
        across, down = np.zeros(size, np.float32), np.zeros(size, np.float32)
        _weigh_bends(views.luma, disparity, across, down)
        raise_if_stopped()
        disparity = _smooth(disparity, target, curvature, across, down)
    return disparity


def _measure_all(views: MatchingViews, disparity: FloatImage, curvature: FloatImage, pull: FloatImage) -> None:
    def measure(first: int, last: int) -> None:
        _measure(views.textures, views.offsets, disparity, first, last, curvature, pull)

    in_bands(measure, image_size(disparity))


def _smooth(
    start: FloatImage,
    target: FloatImage,
    curvature: FloatImage,
    across: FloatImage,
    down: FloatImage,
) -> FloatImage:
    """The map that is near its target where that is sure, and bends little where it may: conjugate gradients."""
    values, product = start.copy(), np.empty_like(start)
    inverse_diagonal = 1 / (_diagonal(curvature, across, down) + LITTLE)
    _apply(values, curvature, across, down, product)
    rest = curvature * target - product
    step = inverse_diagonal * rest
    weight = float(np.vdot(rest, step))
    for _ in range(SOLVER_STEPS):
        raise_if_stopped()
        _apply(step, curvature, across, down, product)
        length = np.float32(weight / max(float(np.vdot(step, product)), 1e-30))
        values += length * step
        rest -= length * product
        steadied = inverse_diagonal * rest
        weight, before = float(np.vdot(rest, steadied)), weight
        step = steadied + np.float32(weight / max(before, 1e-30)) * step
    return values


def _diagonal(curvature: FloatImage, across: FloatImage, down: FloatImage) -> FloatImage:
    """Of the matrix that `_apply` multiplies by."""
    result = curvature + 4 * (across + down)
    result[:, :-1] += across[:, 1:]
    result[:, 1:] += across[:, :-1]
    result[:-1] += down[1:]
    result[1:] += down[:-1]
    return result


@kernel
def _measure(textures, offsets, disparity, first, last, curvature, pull):
    """The square error of a pixel over its disparity, to second order: half its curvature and half its slope.

    Gradients are means of all views that match, in whom noise averages out; squares of single ones would count noise.
    """
    count, height, width = textures.shape
    for y in range(first, last):
        for x in range(width):
            d, here = disparity[y, x], textures[0, y, x]
            along_s = along_t = gradient_x = gradient_y = np.float32(0)
            ss = st = tt = total = np.float32(0)
            for view in range(1, count):
                t, s = offsets[view, 0], offsets[view, 1]
                row, column = y - d * t, x - d * s
                if not (row >= 0 and row <= height - 1 and column >= 0 and column <= width - 1):
                    continue
                y0, x0 = min(int(row), max(height - 2, 0)), min(int(column), max(width - 2, 0))
                y1, x1 = min(y0 + 1, height - 1), min(x0 + 1, width - 1)
                rest_x, rest_y = np.float32(column - x0), np.float32(row - y0)
                slope_top = textures[view, y0, x1] - textures[view, y0, x0]
                slope_bottom = textures[view, y1, x1] - textures[view, y1, x0]
                top = textures[view, y0, x0] + slope_top * rest_x
                down = textures[view, y1, x0] + slope_bottom * rest_x - top
                difference = (top + down * rest_y - here) / np.float32(UNLIKE)
                weight = 1 / (1 + difference * difference)
                weight *= weight
                total += weight
                ss += weight * s * s
                st += weight * s * t
                tt += weight * t * t
                along_s += weight * s * difference
                along_t += weight * t * difference
                gradient_x += weight * (slope_top + (slope_bottom - slope_top) * rest_y)
                gradient_y += weight * down
            gradient_x /= max(total, LITTLE)
            gradient_y /= max(total, LITTLE)
            # A view's texture changes with disparity by -(s d/dx + t d/dy).
            squares = gradient_x * gradient_x * ss + 2 * gradient_x * gradient_y * st + gradient_y * gradient_y * tt
            curvature[y, x] = squares / max(count - 1, 1)
            pull[y, x] = -(gradient_x * along_s + gradient_y * along_t) * np.float32(UNLIKE) / max(count - 1, 1)


@kernel
def _weigh_bends(luma, disparity, across, down):
    """How much each pixel's second differences count, along rows and columns; 0 at the borders."""
    height, width = disparity.shape
    for y in range(height):
        for x in range(1, width - 1):
            edge = max(abs(luma[y, x] - luma[y, x - 1]), abs(luma[y, x + 1] - luma[y, x]))
            bend = (disparity[y, x - 1] - 2 * disparity[y, x] + disparity[y, x + 1]) / np.float32(EDGE_DISPARITY)
            across[y, x] = np.float32(SMOOTHNESS) * np.exp(-edge / np.float32(EDGE_LUMA)) / (1 + bend * bend) ** 2
    for y in range(1, height - 1):
        for x in range(width):
            edge = max(abs(luma[y, x] - luma[y - 1, x]), abs(luma[y + 1, x] - luma[y, x]))
            bend = (disparity[y - 1, x] - 2 * disparity[y, x] + disparity[y + 1, x]) / np.float32(EDGE_DISPARITY)
            down[y, x] = np.float32(SMOOTHNESS) * np.exp(-edge / np.float32(EDGE_LUMA)) / (1 + bend * bend) ** 2


@kernel
def _apply(values, curvature, across, down, product):
    """Fill product with (curvature + B'B) values, where B takes second differences along rows and columns, weighted."""
    height, width = values.shape
    for y in range(height):
        for x in range(width):
            product[y, x] = curvature[y, x] * values[y, x]
    for y in range(height):
        for x in range(1, width - 1):
            bend = across[y, x] * (values[y, x - 1] - 2 * values[y, x] + values[y, x + 1])
            product[y, x - 1] += bend
            product[y, x] -= 2 * bend
            product[y, x + 1] += bend
    for y in range(1, height - 1):
        for x in range(width):
            bend = down[y, x] * (values[y - 1, x] - 2 * values[y, x] + values[y + 1, x])
            product[y - 1, x] += bend
            product[y, x] -= 2 * bend
            product[y + 1, x] += bend
