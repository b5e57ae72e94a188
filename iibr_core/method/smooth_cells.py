"""Cells of target rays that one smooth surface of the photo fills: most of most views.

No source ray has to be splatted there: a backward warp follows each target ray to the point of the photo that it
shows. This gives what splatting gives, at a fraction of its cost.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.method.rays import CELL_PX, RaySet
from iibr_core.runtime.kernels import kernel
from iibr_core.surfaces import EDGE_PX, SAME_SURFACE_PX
from iibr_core.types import FloatImage, ViewOffset

LANDING_REACH_PX = 1.5
"""Largest distance between a pixel's centre and a ray that touches the pixel when it lands, in pixels."""
SETTLED_PX = 0.02
"""Step of the search below which it ends, in pixels: the next step would be far shorter."""
MIN_WIDTH_SHARE = 0.2
"""Smallest share of its width that a smooth surface is compressed to, see `surfaces.SMOOTH_SHARE`."""
MAX_ROUNDS = 30
"""Largest number of steps of the search: each comes at least a fifth closer, mostly far more."""


def find_smooth_cells(
    rays: RaySet, offset: ViewOffset, rows: tuple[int, int], columns: tuple[int, int] | None = None
) -> tuple[NDArray[np.bool_], FloatImage]:
    """Return where (N, M) one smooth surface of the photo fills a cell of the view at `offset`, and its approximate
    disparity (N, M).

    The first row of cells holds the target row rows[0], the last the row before rows[1]. Cells without any of columns
    [first, last), by default all, are not looked at, and not smooth.
    """
    arrays, first = rays.arrays, rows[0] // CELL_PX
    shape = -(-rows[1] // CELL_PX) - first, arrays.low.shape[2]
    far, near = np.full(shape, np.inf, np.float32), np.full(shape, -np.inf, np.float32)
    smooth = cells_in(columns or (0, rays.size.width), shape)
    parallax = max(*map(abs, offset), 1e-9)
    rough = ~(rays.cell_steps <= rays.smooth_step(offset))
    _land_cells(arrays, rough, rays.to_view(offset), first, parallax, (far, near), smooth)
    # Something lands, and its parts stay together.
    smooth &= (near >= far) & ((near - far) * parallax <= EDGE_PX)
    return smooth, np.where(smooth, far, np.float32(0.0))


def cells_in(columns: tuple[int, int], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the cells of this shape (N, M) that hold any of the columns [first, last)."""
    inside = np.zeros(shape, np.bool_)
    inside[:, columns[0] // CELL_PX : -(-columns[1] // CELL_PX)] = True
    return inside


@kernel
def _landing(first, least, most, count):
    """Return the first of `count` target cells that the pixels of cell `first`, moved by -least to -most, touch, and
    the one after the last.
    """
    # Cells are counted from the border of the picture, half a pixel before the first pixel centre.
    shrunk = 0.5 - LANDING_REACH_PX
    before, after = first + (shrunk - max(least, most)) / CELL_PX, first + 1 - (shrunk + min(least, most)) / CELL_PX
    if not (after >= 0 and before < count):
        return 0, 0
    return int(max(before, 0.0)), int(min(after, count - 1.0)) + 1


@kernel
def _land_cells(rays, rough, offsets, first_cell, parallax, ranges, smooth):
    """Let the cells of all sources land, the photo's first. ranges: least and greatest disparity that land smoothly."""
    (far, near), (rows, columns) = ranges, smooth.shape
    # The photo comes first: inpainted rays are compared with what it shows.
    for k in range(len(offsets)):
        t, s = offsets[k]
        for v in range(rays.low.shape[1]):
            # Whole rows of cells that land elsewhere are passed over at once; without rays, their range is not finite.
            least, most = np.float64(rays.row_ranges[k, v, 0]), np.float64(rays.row_ranges[k, v, 1])
            top, bottom = _landing(v - first_cell, least * t, most * t, rows)
            if not (least <= most and top < bottom):
                continue
            for u in range(rays.low.shape[2]):
                least, most = np.float64(rays.low[k, v, u]), np.float64(rays.high[k, v, u])
                if not least <= most:
                    continue
                # All target cells that rays of this cell may touch.
                top, bottom = _landing(v - first_cell, least * t, most * t, rows)
                left, right = _landing(u, least * s, most * s, columns)
                for row in range(top, bottom):
                    for column in range(left, right):
                        # Smooth cells widen the range of landing disparities; all other cells need splatting.
                        if k == 0 and not rough[v, u]:
                            far[row, column] = min(far[row, column], least)
                            near[row, column] = max(near[row, column], most)
                        elif k < rays.photo_images or (most - far[row, column]) * parallax > SAME_SURFACE_PX:
                            smooth[row, column] = False


@kernel
def land_rough(rays, k, to_view, first_cell, splat, needed):
    """Mark in needed (M, N) the cells of source k that may land on a cell that is to be splatted.

    to_view: (t, s) from the source. splat: cells of the view from row `first_cell` on.
    """
    t, s = to_view
    low, high, (rows, columns) = rays.low[k], rays.high[k], splat.shape
    for v in range(len(low)):
        least, most = np.float64(rays.row_ranges[k, v, 0]), np.float64(rays.row_ranges[k, v, 1])
        top, bottom = _landing(v - first_cell, least * t, most * t, rows)
        if not (least <= most and top < bottom):
            continue
        for u in range(low.shape[1]):
            least, most = np.float64(low[v, u]), np.float64(high[v, u])
            if not least <= most:
                continue
            top, bottom = _landing(v - first_cell, least * t, most * t, rows)
            left, right = _landing(u, least * s, most * s, columns)
            # One target cell that needs splatting is enough.
            for row in range(top, bottom):
                for column in range(left, right):
                    needed[v, u] |= splat[row, column]


@kernel
def backward_warp(surface, offset, about, found):
    """Give every ray of the smooth cells one candidate that covers it: the photo's ray, of disparity (H, W) `surface`.

    Its disparity d is the fixed point of d = surface(x + d s, y + d t), bilinear.
    """
    t, s = np.float32(offset[0]), np.float32(offset[1])
    first_row, smooth = found.first_row, found.smooth
    count, coverage, disparity, source = found.number, found.coverage[0], found.disparity[0], found.source[0]
    rows, width = count.shape
    above = first_row % CELL_PX
    guess, is_settled = np.empty(width, np.float32), np.empty(width, np.bool_)
    for cell_row in range(smooth.shape[0]):
        top, bottom = cell_row * CELL_PX - above, min((cell_row + 1) * CELL_PX - above, rows)
        cell = 0
        while cell < smooth.shape[1]:
            first = cell
            # Smooth cells side by side.
            while cell < smooth.shape[1] and smooth[cell_row, cell]:
                guess[cell * CELL_PX : (cell + 1) * CELL_PX] = about[cell_row, cell]
                cell += 1
            if cell == first:
                cell += 1
                continue
            left, right = first * CELL_PX, min(cell * CELL_PX, width)
            # Rows above the band are followed too, so that the results do not depend on where it begins.
            for row in range(top, bottom):
                # The iteration starts from the result of the row before.
                is_settled[left:right] = False
                for _ in range(MAX_ROUNDS):
                    if not _follow(surface, guess, is_settled, left, right, first_row + row, t, s):
                        break
                if row < 0:
                    continue
                # One candidate that covers its ray whole.
                count[row, left:right], coverage[row, left:right], source[row, left:right] = 1, np.float32(1.0), 0
                disparity[row, left:right] = guess[left:right]


@kernel
def _follow(surface, guess, is_settled, left, right, y, t, s):
    """Take one of Newton's steps towards the fixed point for the rays [left, right) of a row.

    Return whether a ray needs another step.

    A slope of at most 0.4 px a pixel along each axis (SMOOTH_SHARE of the step that SAME_SURFACE_PX gives) keeps
    it stable.
    """
    height, width = surface.shape
    flat, parallax, moves_on = surface.reshape(-1), max(abs(s), abs(t)), 0
    one, least_left, settled = np.float32(1.0), np.float32(MIN_WIDTH_SHARE), np.float32(SETTLED_PX)
    x = left
    while x < right:
        # Rays side by side that look between the same pixels side by side are followed together.
        column, line = np.floor(guess[x] * s), np.floor(guess[x] * t)
        end, last = x + 1, min(right, width - 1 - column)
        is_inside = 0 <= y + line < height - 1 and 0 <= x + column < width - 1
        while is_inside and end < last and np.floor(guess[end] * s) == column and np.floor(guess[end] * t) == line:
            end += 1
        if is_inside:
            upper = np.uint64((y + int(line)) * width + x + int(column))
            lower, at, next_ = upper + np.uint64(width), np.uint64(x), np.uint64(1)
            for i in range(np.uint64(end - x)):
                d = guess[at + i]
                fx, fy = d * s - column, d * t - line
                a, b, c, e = flat[upper + i], flat[upper + i + next_], flat[lower + i], flat[lower + i + next_]
                above, below = a + fx * (b - a), c + fx * (e - c)
                slope = s * ((one - fy) * (b - a) + fy * (e - c)) + t * (below - above)
                step = (above + fy * (below - above) - d) / max(one - slope, least_left)
                # Rays that have settled wait for the others.
                guess[at + i] = d if is_settled[at + i] else d + step
                is_settled[at + i] = is_settled[at + i] or abs(step) * parallax < settled
                moves_on += not is_settled[at + i]
        else:
            # Off the picture nothing is to be followed.
            v, u = min(max(y + guess[x] * t, 0.0), height - 1.0), min(max(x + guess[x] * s, 0.0), width - 1.0)
            guess[x] = surface[int(v), int(u)]
        x = end
    return moves_on > 0
