"""Cells of target rays that one smooth surface of the photo fills: most of most views.

No source ray has to be splatted there: a backward warp follows each target ray to the point of the photo that it
shows. This gives what splatting gives, at a fraction of its cost.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.ray_cells import CELL_PX, Cells
from iibr_core.rendering.ray_set import OWN_SURFACE_PX, RaySet
from iibr_core.runtime.jit import kernel
from iibr_core.types import FloatImage, ViewOffset

LANDING_REACH_PX = 1.5
"""A ray that lands farther than this from a pixel's centre does not touch the pixel."""
ONE_SURFACE_PX = 1.0
"""What lands on a cell with more parallax between its parts is not taken for one surface."""
SETTLED_PX = 0.002
"""A ray is followed until it moves by less than this."""
MOST_ROUNDS = 30
"""On a smooth surface each round comes at least a fifth closer, mostly far more (see `ray_set.SMOOTH_SHARE`)."""
ONE = np.uint64(1)


def find_coherent_cells(
    rays: RaySet, offset: ViewOffset, rows: tuple[int, int]
) -> tuple[NDArray[np.bool_], FloatImage]:
    """Where all that shows in a cell of the view at `offset` is one smooth surface of the photo, (N, M); and about
    which disparity that has, (N, M).

    The first row of cells holds the target row rows[0], the last the row before rows[1].
    """
    cells, first = rays.cells, rows[0] // CELL_PX
    shape = -(-rows[1] // CELL_PX) - first, cells.low.shape[2]
    far, near = np.full(shape, np.inf, np.float32), np.full(shape, -np.inf, np.float32)
    smooth = np.ones(shape, np.bool_)
    parallax = max(*map(abs, offset), 1e-9)
    incoherent = ~(cells.step <= rays.smooth_step(offset))
    _land_cells(cells, incoherent, rays.to_view(offset), first, rays.photo_images, parallax, far, near, smooth)
    # Something lands, and its parts stay together.
    smooth &= (near >= far) & ((near - far) * parallax <= ONE_SURFACE_PX)
    return smooth, np.where(smooth, far, np.float32(0.0))


def land_incoherent(
    cells: Cells, k: int, t: float, s: float, rows: tuple[int, int], smooth: NDArray[np.bool_]
) -> NDArray[np.bool_]:
    """Which cells (M, N) of source k, t and s away, land on any cell of these rows that is not smooth."""
    needed = np.zeros(cells.step.shape, np.bool_)
    _land_incoherent(cells, k, t, s, rows[0] // CELL_PX, smooth, needed)
    return needed


def land_marked(
    cells: Cells, offsets: NDArray[np.float64], marked: NDArray[np.bool_], rows: tuple[int, int], around_px: int
) -> NDArray[np.bool_]:
    """Which target cells (N, M) of these rows have rays of the marked cells (S, M, M') land within around_px of them.

    offsets (S, 2): from each source to the view.
    """
    first = rows[0] // CELL_PX
    landed = np.zeros((-(-rows[1] // CELL_PX) - first, marked.shape[2]), np.bool_)
    _land_marked(cells, offsets, marked, first, around_px, landed)
    return landed


@kernel
def _target_cells(first, least, most):
    """The first and last cell that the pixels of cell `first` touch when moved by -least to -most pixels; fractions."""
    # Cells are counted from the border of the picture, half a pixel before the first pixel centre.
    shrunk = 0.5 - LANDING_REACH_PX
    return first + (shrunk - max(least, most)) / CELL_PX, first + 1 - (shrunk + min(least, most)) / CELL_PX


@kernel
def _touches(least, most, t, row, rows):
    """Whether a row of cells with these disparities can land on cells [0, rows)."""
    top, bottom = _target_cells(row, np.float64(least) * t, np.float64(most) * t)
    return least <= most and bottom >= 0 and top < rows


@kernel
def _land_cells(cells, incoherent, offsets, first_cell, photo_images, parallax, far, near, smooth):
    """Let the cells of all sources land, the photo's first. far, near: disparities of the smooth ones that land."""
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
                        # Smooth cells widen the range of what lands; anything else there asks for splatting.
                        if k == 0 and not incoherent[v, u]:
                            far[row, column] = min(far[row, column], least)
                            near[row, column] = max(near[row, column], most)
                        elif k < photo_images or (most - far[row, column]) * parallax > OWN_SURFACE_PX:
                            smooth[row, column] = False


@kernel
def _land_incoherent(cells, k, t, s, first_cell, smooth, needed):
    low, high, row_ranges = cells.low[k], cells.high[k], cells.row_ranges[k]
    rows, columns = smooth.shape
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
                    needed[v, u] |= not smooth[row, column]


@kernel
def _land_marked(cells, offsets, marked, first_cell, around_px, landed):
    low, high = cells.low, cells.high
    rows, columns = landed.shape
    around = around_px / CELL_PX
    for k in range(len(marked)):
        t, s = offsets[k]
        for v in range(low.shape[1]):
            for u in range(low.shape[2]):
                if not marked[k, v, u]:
                    continue
                least, most = np.float64(low[k, v, u]), np.float64(high[k, v, u])
                top, bottom = _target_cells(v - first_cell, least * t, most * t)
                left, right = _target_cells(u, least * s, most * s)
                top, bottom, left, right = top - around, bottom + around, left - around, right + around
                if not (least <= most and bottom >= 0 and top < rows and right >= 0 and left < columns):
                    continue
                for row in range(int(max(top, 0.0)), int(min(bottom, rows - 1.0)) + 1):
                    landed[row, int(max(left, 0.0)) : int(min(right, columns - 1.0)) + 1] = True


@kernel
def backward_warp(surface, offset, about, found):
    """Give every ray of the smooth cells one candidate that covers it: the photo's ray, of disparity (H, W) `surface`.

    Its disparity d is the fixed point of d = surface(x + d s, y + d t), bilinear.
    """
    (t, s), first_row, smooth = offset, found.first_row, found.smooth
    count, coverage, disparity, source = found.number, found.coverage, found.disparity, found.source
    rows, width = count.shape
    # The bilinear taps of the last position, too, lie inside.
    last_u, last_v = surface.shape[1] - 1.001, surface.shape[0] - 1.001
    above = first_row % CELL_PX
    parallax = max(abs(s), abs(t))
    guess = np.empty(CELL_PX)
    for cell_row in range(smooth.shape[0]):
        top, bottom = cell_row * CELL_PX - above, min((cell_row + 1) * CELL_PX - above, rows)
        for cell in range(smooth.shape[1]):
            if not smooth[cell_row, cell]:
                continue
            left = cell * CELL_PX
            columns = min(CELL_PX, width - left)
            # Rows above the band are followed too, so that the results do not depend on where it begins.
            guess[:] = about[cell_row, cell]
            for row in range(top, bottom):
                # Fixed-point iteration, from what the row before came to. A slope of at most 0.4 px a pixel along each
                # axis
                # (SMOOTH_SHARE of the step that OWN_SURFACE_PX gives) makes it contract.
                for _ in range(MOST_ROUNDS):
                    moved = 0.0
                    for i in range(columns):
                        d = guess[i]
                        source_x = min(max(left + i + d * s, 0.0), last_u)
                        source_y = min(max(first_row + row + d * t, 0.0), last_v)
                        column, line = int(source_x), int(source_y)
                        fx, fy = source_x - column, source_y - line
                        u, v = np.uint64(column), np.uint64(line)
                        upper = (1 - fx) * surface[v, u] + fx * surface[v, u + ONE]
                        lower = (1 - fx) * surface[v + ONE, u] + fx * surface[v + ONE, u + ONE]
                        guess[i] = upper + fy * (lower - upper)
                        moved = max(moved, abs(guess[i] - d))
                    if moved * parallax < SETTLED_PX:
                        break
                # One candidate that covers its ray whole.
                for i in range(columns if row >= 0 else 0):
                    count[row, left + i], coverage[0, row, left + i], source[0, row, left + i] = 1, 1.0, 0
                    disparity[0, row, left + i] = guess[i]
