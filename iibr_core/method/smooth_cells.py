"""Cells of target rays that one smooth surface of the photo fills: most of most views.

No source ray has to be splatted there: a backward warp follows each target ray to the point of the photo that it
shows. This gives what splatting gives, at a fraction of its cost.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.method.rays import CELL_PX, Cells, RaySet
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
    cells, first = rays.cells, rows[0] // CELL_PX
    shape = -(-rows[1] // CELL_PX) - first, cells.low.shape[2]
    far, near = np.full(shape, np.inf, np.float32), np.full(shape, -np.inf, np.float32)
    smooth = cells_in(columns or (0, rays.size.width), shape)
    parallax = max(*map(abs, offset), 1e-9)
    rough = ~(cells.step <= rays.smooth_step(offset))
    _land_cells(cells, rough, rays.to_view(offset), first, rays.photo_images, parallax, (far, near), smooth)
    # Something lands, and its parts stay together.
    smooth &= (near >= far) & ((near - far) * parallax <= EDGE_PX)
    return smooth, np.where(smooth, far, np.float32(0.0))


def cells_in(columns: tuple[int, int], shape: tuple[int, int]) -> NDArray[np.bool_]:
    """Return the cells of this shape (N, M) that hold any of the columns [first, last)."""
    inside = np.zeros(shape, np.bool_)
    inside[:, columns[0] // CELL_PX : -(-columns[1] // CELL_PX)] = True
    return inside


def land_rough(
    cells: Cells, k: int, t: float, s: float, rows: tuple[int, int], splat: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Return which cells (M, N) of source k, t and s away, may land on a cell of these rows that is to be splatted."""
    needed = np.zeros(cells.step.shape, np.bool_)
    _land_rough(cells, k, t, s, rows[0] // CELL_PX, splat, needed)
    return needed


@kernel
def _target_cells(first, least, most):
    """Return the first and last cell (fractions) that the pixels of cell `first` touch, moved by -least to -most."""
    # Cells are counted from the border of the picture, half a pixel before the first pixel centre.
    shrunk = 0.5 - LANDING_REACH_PX
    return first + (shrunk - max(least, most)) / CELL_PX, first + 1 - (shrunk + min(least, most)) / CELL_PX


@kernel
def _touches(least, most, t, row, rows):
    """Return whether a row of cells with these disparities can land on cells [0, rows)."""
    top, bottom = _target_cells(row, np.float64(least) * t, np.float64(most) * t)
    return least <= most and bottom >= 0 and top < rows


@kernel
def _land_cells(cells, rough, offsets, first_cell, photo_images, parallax, ranges, smooth):
    """Let the cells of all sources land, the photo's first. ranges: least and greatest disparity that land smoothly."""
    far, near = ranges
    low, high, row_ranges = cells.low, cells.high, cells.row_ranges
    rows, columns = smooth.shape
    # The photo comes first: inpainted rays are compared with what it shows.
    for k in range(len(offsets)):
        t, s = offsets[k]
        for v in range(low.shape[1]):
            # Whole rows of cells that land elsewhere are passed over at once.
            if not _touches(row_ranges[k, v, 0], row_ranges[k, v, 1], t, v - first_cell, rows):
                continue
            for u in range(low.shape[2]):
                # All target cells that rays of this cell may touch.
                least, most = np.float64(low[k, v, u]), np.float64(high[k, v, u])
                top, bottom = _target_cells(v - first_cell, least * t, most * t)
                left, right = _target_cells(u, least * s, most * s)
                if not (least <= most and bottom >= 0 and top < rows and right >= 0 and left < columns):
                    continue
                for row in range(int(max(top, 0.0)), int(min(bottom, rows - 1.0)) + 1):
                    for column in range(int(max(left, 0.0)), int(min(right, columns - 1.0)) + 1):
                        # Smooth cells widen the range of landing disparities; all other cells need splatting.
                        if k == 0 and not rough[v, u]:
                            far[row, column] = min(far[row, column], least)
                            near[row, column] = max(near[row, column], most)
                        elif k < photo_images or (most - far[row, column]) * parallax > SAME_SURFACE_PX:
                            smooth[row, column] = False


@kernel
def _land_rough(cells, k, t, s, first_cell, splat, needed):
    low, high, row_ranges = cells.low[k], cells.high[k], cells.row_ranges[k]
    rows, columns = splat.shape
    for v in range(low.shape[0]):
        if not _touches(row_ranges[v, 0], row_ranges[v, 1], t, v - first_cell, rows):
            continue
        for u in range(low.shape[1]):
            least, most = np.float64(low[v, u]), np.float64(high[v, u])
            top, bottom = _target_cells(v - first_cell, least * t, most * t)
            left, right = _target_cells(u, least * s, most * s)
            if not (least <= most and bottom >= 0 and top < rows and right >= 0 and left < columns):
                continue
            for row in range(int(max(top, 0.0)), int(min(bottom, rows - 1.0)) + 1):
                for column in range(int(max(left, 0.0)), int(min(right, columns - 1.0)) + 1):
                    # One target cell that needs splatting is enough.
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
