"""Draws the rays of a ray set as squares into the samples of a target's pixels, by a matrix of disparity space.

Squares meet their neighbours on the same surface; a z-test keeps the nearest.
"""

from __future__ import annotations

from math import ceil

import numpy as np
from numpy.typing import NDArray

from iibr_core.method.candidates import SEALED_GAP_PX
from iibr_core.method.rays import CELL_PX, RaySet
from iibr_core.runtime.kernels import kernel
from iibr_core.surfaces import same_surface
from iibr_core.types import FloatImage

SAMPLES = 3
"""Number of samples across a target pixel and down; a square covers a sample entirely or not at all."""
MIN_DRAWN_DEPTH = 1e-3
"""Least depth of rays that are drawn, as a share of their depth in the photo."""
MAX_SQUARE_PX = 16.0
"""Largest square that is drawn: the photo has no details for larger ones."""
COVERING_ORDER = np.array([4, 0, 8, 2, 6, 1, 7, 3, 5]).argsort()
"""Order in which a ray that covers its pixel in part takes samples, so that any share is spread over the pixel."""
INSIDE = 1e-6
"""Tolerance of the test whether a sample is in a triangle: those on a shared side belong to both triangles."""
CORNERS = np.array([(-1, -1), (-1, 1), (1, 1), (1, -1)])
"""Directions (y, x) of a pixel's corners, clockwise."""


def rows_landed_on(rays: RaySet, k: int, matrix: NDArray[np.float64]) -> FloatImage:
    """Return the first and last target row (M, N, 2) that rays in each cell of image k may land on.

    It is (inf, -inf) for cells without rays. The boxes around the cells in disparity space stay convex.
    """
    low, high = rays.arrays.low[k], rays.arrays.high[k]
    # Corners of pixels have disparities of the cells around.
    bounds = [_combine_3x3(np.minimum, low)] * 4 + [_combine_3x3(np.maximum, high)] * 4
    v, u = np.indices(low.shape)
    corners = [(CELL_PX * (u + i) - 0.5, CELL_PX * (v + j) - 0.5) for j, i in np.ndindex(2, 2)] * 2
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        points = np.stack([(x, y, np.ones(low.shape), d) for (x, y), d in zip(corners, bounds)])
        y, w = np.einsum("ij,cjvu->icvu", matrix[1:3], points)
        rows, is_ahead = y / w, (w > MIN_DRAWN_DEPTH).all(axis=0)
    # Cells that reach behind the camera may land anywhere.
    first, last = np.where(is_ahead, rows.min(axis=0), -np.inf), np.where(is_ahead, rows.max(axis=0), np.inf)
    has_rays = low <= high
    return np.stack([np.where(has_rays, first, np.inf), np.where(has_rays, last, -np.inf)], -1).astype(np.float32)


def _combine_3x3(combine: np.ufunc, image: FloatImage) -> FloatImage:
    """Return the values of 3x3 pixels around each, combined; the border is repeated."""
    padded = np.pad(image, 1, mode="edge")
    rows = combine(combine(padded[:-2], padded[1:-1]), padded[2:])
    return np.asarray(combine(combine(rows[:, :-2], rows[:, 1:-1]), rows[:, 2:]))


def draw_rays(
    rays: RaySet,
    matrices: list[tuple[float, ...]],
    landing: list[FloatImage],
    surface: float,
    sealed_step: float,
    rows: tuple[int, int],
    width: int,
) -> tuple[FloatImage, NDArray[np.uint8]]:
    """Return the nearest disparity at each sample of target rows [first, last), and 1 + the index of its source.

    The index is 0 where nothing landed. There are SAMPLES times as many rows and columns as in the target. surface:
    difference of disparities on one surface. sealed_step: see `_land_squares`.
    """
    first, last = rows
    shape = SAMPLES * (last - first), SAMPLES * width
    nearest, source = np.full(shape, -np.inf, np.float32), np.zeros(shape, np.uint8)
    for k, matrix in enumerate(matrices):
        # The photo's rays have precedence over inpainted ones beside them.
        ahead = surface if k >= rays.photo_images else 0.0
        _draw_rays(rays.arrays, k, landing[k], matrix, ahead, sealed_step, first, (nearest, source))
    return nearest, source


@kernel
def project(m, x, y, d):
    """Return (x, y, d) transformed by a matrix of 16 numbers, and the factor by which the result was divided."""
    w = m[8] * x + m[9] * y + m[10] + m[11] * d
    return (
        (m[0] * x + m[1] * y + m[2] + m[3] * d) / w,
        (m[4] * x + m[5] * y + m[6] + m[7] * d) / w,
        (m[12] * x + m[13] * y + m[14] + m[15] * d) / w,
        w,
    )


@kernel
def _draw_rays(rays, index, landing, m, ahead, sealed_step, first_row, target):
    """Draw the rays of one image. ahead: least difference of disparities by which they hide the photo's rays. target:
    disparity and source of the samples.
    """
    disparity, coverage = rays.disparity[index], rays.coverage[index]
    height, width = disparity.shape
    last_row = first_row + len(target[0]) // SAMPLES - 1
    corners, is_drawn = np.empty((width, 4, 3)), np.empty(width, np.bool_)
    is_near = np.empty(landing.shape[1], np.bool_)
    for y in range(height):
        # Most cells land on other rows: they are tested once, not pixel by pixel.
        if y % CELL_PX == 0:
            for u in range(len(is_near)):
                first_landed, last_landed = landing[y // CELL_PX, u]
                is_near[u] = last_landed >= first_row - 1 and first_landed <= last_row + 1
        if not is_near.any():
            continue
        any_drawn = False
        for x in range(width):
            is_drawn[x] = is_near[x // CELL_PX] and coverage[y, x] > 0
            any_drawn = any_drawn or is_drawn[x]
        if any_drawn:
            _land_squares(disparity, m, y, sealed_step, corners, is_drawn)
            _draw_squares(corners, is_drawn, coverage[y], index, rays.photo_images, ahead, first_row, target)


@kernel
def _land_squares(disparity, m, y, sealed_step, corners, is_drawn):
    """Write where the corners of a row of pixels land, (X, Y, D); squares that reach behind the camera are not drawn.

    A corner's disparity is the mean of those around it on the pixel's surface: where these agree, there are no cracks.
    sealed_step: largest difference of disparities on one surface however far apart they land.
    """
    height, width = disparity.shape
    for x in range(width):
        if not is_drawn[x]:
            continue
        here = disparity[y, x]
        # The largest step whose gap is closed.
        at_x, at_y, _, _ = project(m, x, y, here)
        wide = max(abs(m[0] - at_x * m[8]), abs(m[5] - at_y * m[9]), abs(m[1] - at_x * m[9]), abs(m[4] - at_y * m[8]))
        one_surface = SEALED_GAP_PX * wide / max(abs(m[3] - at_x * m[11]), abs(m[7] - at_y * m[11]), 1e-9)
        one_surface = max(one_surface, sealed_step)
        for corner in range(4):
            v, u = y + CORNERS[corner, 0], x + CORNERS[corner, 1]
            has_row, has_column = 0 <= v < height, 0 <= u < width
            total, count = np.float64(here), 1
            is_across = is_along = False
            if has_column and same_surface(disparity[y, u], here, one_surface):
                is_across, total, count = True, total + disparity[y, u], count + 1
            if has_row and same_surface(disparity[v, x], here, one_surface):
                is_along, total, count = True, total + disparity[v, x], count + 1
            if has_row and has_column:
                down = same_surface(disparity[v, u], disparity[y, u], one_surface)
                right = same_surface(disparity[v, u], disparity[v, x], one_surface)
                if (is_across and down) or (is_along and right):
                    total, count = total + disparity[v, u], count + 1
            at_x, at_y, d, w = project(m, 0.5 * (x + u), 0.5 * (y + v), total / count)
            corners[x, corner, 0], corners[x, corner, 1], corners[x, corner, 2] = at_x, at_y, d
            is_drawn[x] = is_drawn[x] and w > MIN_DRAWN_DEPTH


@kernel
def _draw_squares(corners, is_drawn, coverage, index, photo_images, ahead, first_row, target):
    """Draw each pixel as two triangles from where its corners landed: disparity is linear over planes."""
    nearest, source = target
    rows, columns = nearest.shape
    for x in range(len(corners)):
        if not is_drawn[x]:
            continue
        filled = coverage[x] * SAMPLES**2
        x0, y0, d0 = corners[x, 0, 0], corners[x, 0, 1], corners[x, 0, 2]
        for b in range(1, 3):
            x1, y1, d1 = corners[x, b, 0] - x0, corners[x, b, 1] - y0, corners[x, b, 2] - d0
            x2, y2, d2 = corners[x, b + 1, 0] - x0, corners[x, b + 1, 1] - y0, corners[x, b + 1, 2] - d0
            area = x1 * y2 - x2 * y1
            left, right = x0 + min(0.0, x1, x2), x0 + max(0.0, x1, x2)
            top, bottom = y0 + min(0.0, y1, y2) - first_row, y0 + max(0.0, y1, y2) - first_row
            # Skips triangles that are seen from behind, not finite or too large.
            if not (area > 1e-9 and right - left <= MAX_SQUARE_PX and bottom - top <= MAX_SQUARE_PX):
                continue
            if not (right > -0.5 and left * SAMPLES < columns and bottom > -0.5 and top * SAMPLES < rows):
                continue
            first_v, last_v = max(_sample_after(top), 0), min(_sample_after(bottom), rows - 1)
            first_u, last_u = max(_sample_after(left), 0), min(_sample_after(right), columns - 1)
            for v in range(first_v, last_v + 1):
                down = (v + 0.5) / SAMPLES - 0.5 + first_row - y0
                for u in range(first_u, last_u + 1):
                    across = (u + 0.5) / SAMPLES - 0.5 - x0
                    # Barycentric: the shares of the second and the third corner.
                    of_b, of_c = (across * y2 - x2 * down) / area, (x1 * down - across * y1) / area
                    if not (of_b >= -INSIDE and of_c >= -INSIDE and of_b + of_c <= 1.0 + INSIDE):
                        continue
                    if filled <= COVERING_ORDER[v % SAMPLES * SAMPLES + u % SAMPLES] + 0.5:
                        continue
                    d = np.float32(d0 + of_b * d1 + of_c * d2)
                    if d > nearest[v, u] + (ahead if 0 < source[v, u] <= photo_images else 0.0):
                        nearest[v, u], source[v, u] = d, index + 1


@kernel
def _sample_after(position):
    """Return the index of the first sample at a position of the target or after it."""
    return ceil((position + 0.5) * SAMPLES - 0.5)
