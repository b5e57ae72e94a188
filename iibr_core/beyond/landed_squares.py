"""The rays of a ray set, drawn as squares by a matrix of disparity space: what the samples of a target's pixels see.

Squares meet their neighbours on the same surface; a z-test keeps the nearest.
"""

from __future__ import annotations

from math import ceil

import numpy as np
from numpy.typing import NDArray

from iibr_core.method.candidates import SEALED_GAP_PX
from iibr_core.method.rays import CELL_PX, RaySet
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.surfaces import same_surface
from iibr_core.types import FloatImage, ImageSize

SAMPLES = 3
"""A target pixel has SAMPLES x SAMPLES of them; what lands on one covers it whole."""
LEAST_DEPTH = 1e-3
"""Nearer to the camera, as a share of its distance from the photo's, nothing is drawn."""
MOST_MAGNIFIED_PX = 16.0
"""A square that lands larger than this is left out: the photo knows nothing so small."""
# The order in which a ray that fills its pixel in part covers samples: any share is spread over the pixel.
COVERING_ORDER = np.array([4, 0, 8, 2, 6, 1, 7, 3, 5]).argsort()
INSIDE = 1e-6
"""Samples on a side shared by two triangles belong to both."""
CORNERS = np.array([(-1, -1), (-1, 1), (1, 1), (1, -1)])
"""(y, x) of a pixel's corners, clockwise."""


def rows_landed_on(rays: RaySet, k: int, matrix: tuple[float, ...]) -> FloatImage:
    """(M, N, 2): the first and last target row that the rays in each cell of image k may land on, (inf, -inf) without
    rays.
    """
    cells = rays.cells
    landing = np.empty((*cells.low.shape[1:], 2), np.float32)
    size = ImageSize(*cells.low.shape[1:])
    in_bands(lambda first, last: _land_cells(cells.low[k], cells.high[k], matrix, first, last, landing), size)
    return landing


def draw_rays(
    rays: RaySet,
    matrices: list[tuple[float, ...]],
    landing: list[FloatImage],
    surface: float,
    sealed_step: float,
    rows: tuple[int, int],
    width: int,
) -> tuple[FloatImage, NDArray[np.uint8]]:
    """What the samples of target rows [first, last) see, SAMPLES times as many rows and columns: the nearest disparity,
    and 1 + the index of its source, 0 where nothing landed.
    """
    first, last = rows
    shape = SAMPLES * (last - first), SAMPLES * width
    nearest, source = np.full(shape, -np.inf, np.float32), np.zeros(shape, np.uint8)
    for k, matrix in enumerate(matrices):
        # The photo's rays go before inpainted ones beside them.
        ahead = surface if k >= rays.photo_images else 0.0
        _draw_rays(rays.arrays, k, landing[k], matrix, ahead, sealed_step, first, nearest, source)
    return nearest, source


@kernel
def project(m, x, y, d):
    """(x, y, d) by a matrix of 16 numbers: its (X, Y, D) and the factor they were divided by."""
    w = m[8] * x + m[9] * y + m[10] + m[11] * d
    return (
        (m[0] * x + m[1] * y + m[2] + m[3] * d) / w,
        (m[4] * x + m[5] * y + m[6] + m[7] * d) / w,
        (m[12] * x + m[13] * y + m[14] + m[15] * d) / w,
        w,
    )


@kernel
def _land_cells(low, high, m, first, last, landing):
    """`rows_landed_on` of rows [first, last) of cells: their boxes in disparity space stay convex."""
    rows, columns = low.shape
    for v in range(first, last):
        for u in range(columns):
            landing[v, u, 0], landing[v, u, 1] = np.inf, -np.inf
            if not low[v, u] <= high[v, u]:
                continue
            # Corners of pixels take part in the disparities of the cells around.
            least, most = low[v, u], high[v, u]
            for j in range(max(v - 1, 0), min(v + 2, rows)):
                for i in range(max(u - 1, 0), min(u + 2, columns)):
                    least, most = min(least, low[j, i]), max(most, high[j, i])
            for corner in range(8):
                x = CELL_PX * (u + (corner & 1)) - 0.5
                y = CELL_PX * (v + (corner >> 1 & 1)) - 0.5
                _, row, _, w = project(m, x, y, most if corner & 4 else least)
                if not w > LEAST_DEPTH:  # it reaches behind the camera: anywhere
                    landing[v, u, 0], landing[v, u, 1] = -np.inf, np.inf
                    break
                landing[v, u, 0], landing[v, u, 1] = min(landing[v, u, 0], row), max(landing[v, u, 1], row)


@kernel
def _draw_rays(rays, index, landing, m, ahead, sealed_step, first_row, nearest, source):
    """Draw the rays of one image; see `draw_rays`. ahead: so much nearer than the photo's surface it must
    be to hide it.
    """
    disparity, coverage = rays.disparity[index], rays.coverage[index]
    height, width = disparity.shape
    last_row = first_row + len(nearest) // SAMPLES - 1
    corners, is_drawn = np.empty((width, 4, 3)), np.empty(width, np.bool_)
    is_near = np.empty(landing.shape[1], np.bool_)
    for y in range(height):
        # Most cells land on other rows: they are looked at once, not pixel by pixel.
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
            _draw_squares(corners, is_drawn, coverage[y], index, rays.photo_images, ahead, first_row, nearest, source)


@kernel
def _land_squares(disparity, m, y, sealed_step, corners, is_drawn):
    """Where the corners of a row of pixels land: (X, Y, D) each; what reaches behind the camera is not drawn.

    A corner's disparity is the mean of those around it on the pixel's surface: where these agree, there are no cracks.
    """
    height, width = disparity.shape
    for x in range(width):
        if not is_drawn[x]:
            continue
        here = disparity[y, x]
        # Steps of disparity that open a gap as wide as may be sealed, or that rounding has left.
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
            is_drawn[x] = is_drawn[x] and w > LEAST_DEPTH


@kernel
def _draw_squares(corners, is_drawn, coverage, index, photo_images, ahead, first_row, nearest, source):
    """Draw pixels whose corners landed so, two triangles each: disparity is linear over planes."""
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
            # Seen from behind, not finite, or too large.
            if not (area > 1e-9 and right - left <= MOST_MAGNIFIED_PX and bottom - top <= MOST_MAGNIFIED_PX):
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
    """The first sample at a position of the target, or after it."""
    return ceil((position + 0.5) * SAMPLES - 0.5)
