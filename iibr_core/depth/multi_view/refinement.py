"""Disparity between the steps of a sweep: least squares on the differences of views (Lucas and Kanade, IJCAI 1981).

The map is smooth in its second derivative, so that slants stay slants, except at edges of the picture and of the map.
"""

from __future__ import annotations

import numpy as np

from iibr_core.depth.multi_view.matching import STEP_PX, MatchingViews
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.types import FloatImage, image_size

HIDDEN_DIFFERENCE = 0.01
"""Difference of texture (1 = white) at which a view weighs a quarter, as hidden (weights of Geman and McClure)."""
SMOOTHNESS = 1e-2
"""Weight of bends of the map."""
EDGE_COLOR = 0.05
"""Edge of a channel (1 = white) at which bends weigh a third."""
EDGE_DISPARITY = 0.1
"""Bend of the map (px per view step) that weighs a quarter, as an edge."""
ROUNDS = 3
"""Number of times that differences are measured and the map is moved."""
EPSILON = np.finfo(np.float32).eps


def refine_by_gradients(views: MatchingViews, disparity: FloatImage) -> FloatImage:
    """Return the disparity (H, W) of the reference, moved by less than a step of a sweep and smoothed."""
    size = image_size(disparity)
    longest = np.float32(STEP_PX / views.reach)
    curvature, pull = np.empty(size, np.float32), np.empty(size, np.float32)
    for _ in range(ROUNDS):

        def measure(first: int, last: int, disparity: FloatImage = disparity) -> None:
            _measure(views.textures, views.offsets, disparity, first, last, curvature, pull)

        in_bands(measure, size)
        target = disparity + np.clip(-pull / (curvature + EPSILON), -longest, longest)
        across, down = np.zeros(size, np.float32), np.zeros(size, np.float32)
        _weigh_bends(views.colors, disparity, across)
        _weigh_bends(views.colors.swapaxes(0, 1), disparity.T, down.T)
        disparity = _smooth(disparity, target, curvature, across, down)
    return disparity


def _smooth(
    start: FloatImage, target: FloatImage, curvature: FloatImage, across: FloatImage, down: FloatImage
) -> FloatImage:
    """Return the map that follows its target as far as `curvature` weighs it and bends little: conjugate gradients."""
    values, product = start.copy(), np.empty_like(start)
    inverse_diagonal = 1 / (_diagonal(curvature, across, down) + EPSILON)
    _apply(values, curvature, across, down, product)
    rest = curvature * target - product
    step = inverse_diagonal * rest
    weight = float(np.vdot(rest, step))
    for _ in range(40):
        raise_if_stopped()
        _apply(step, curvature, across, down, product)
        length = np.float32(weight / max(float(np.vdot(step, product)), 1e-30))
        values += length * step
        rest -= length * product
        scaled = inverse_diagonal * rest
        previous, weight = weight, float(np.vdot(rest, scaled))
        step = scaled + np.float32(weight / max(previous, 1e-30)) * step
    return values


def _diagonal(curvature: FloatImage, across: FloatImage, down: FloatImage) -> FloatImage:
    """Return the diagonal (H, W) of the matrix that `_apply` multiplies by."""
    result = curvature + 4 * (across + down)
    result[:, :-1] += across[:, 1:]
    result[:, 1:] += across[:, :-1]
    result[:-1] += down[1:]
    result[1:] += down[:-1]
    return result


@kernel
def _measure(textures, offsets, disparity, first, last, curvature, pull):
    """Measure the square error of each pixel over its disparity to second order: half its curvature, half its slope.

    Gradients are means of all views that match, in which noise averages out; squares of single ones would count noise.
    """
    count, height, width = textures.shape
    for y in range(first, last):
        for x in range(width):
            d, reference = disparity[y, x], textures[0, y, x]
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
                difference = (top + down * rest_y - reference) / np.float32(HIDDEN_DIFFERENCE)
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
            gradient_x /= max(total, EPSILON)
            gradient_y /= max(total, EPSILON)
            # A view's texture changes with disparity by -(s d/dx + t d/dy).
            squares = gradient_x * gradient_x * ss + 2 * gradient_x * gradient_y * st + gradient_y * gradient_y * tt
            curvature[y, x] = squares / (count - 1)
            pull[y, x] = -(gradient_x * along_s + gradient_y * along_t) * np.float32(HIDDEN_DIFFERENCE) / (count - 1)


@kernel
def _weigh_bends(colors, disparity, weights):
    """Fill the weights of each pixel's second difference along its row; 0 stays at the borders."""
    height, width = disparity.shape
    for y in range(height):
        for x in range(1, width - 1):
            edge = np.float32(0)
            for channel in range(3):
                before, here, after = colors[y, x - 1, channel], colors[y, x, channel], colors[y, x + 1, channel]
                edge = max(edge, max(abs(here - before), abs(after - here)))
            bend = (disparity[y, x - 1] - 2 * disparity[y, x] + disparity[y, x + 1]) / np.float32(EDGE_DISPARITY)
            weights[y, x] = np.float32(SMOOTHNESS) * np.exp(-edge / np.float32(EDGE_COLOR)) / (1 + bend * bend) ** 2


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
