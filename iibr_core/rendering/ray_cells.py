"""Cells of rays: what lies in CELL_PX x CELL_PX of them, so that whole cells can be passed over at once."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage

CELL_PX = 4
"""Side of the cells that rays are summarised by."""


class Cells(NamedTuple):
    """Rays of S images, summarised by cells of CELL_PX x CELL_PX. low, high (S, M, N): their least and greatest
    disparity, (inf, -inf) without rays. row_ranges (S, M, 2): the same of whole rows of cells. step (M, N): the largest
    step between the photo's pixels there and those beside them, inf where one is unknown or at the border.
    """

    low: FloatImage
    high: FloatImage
    row_ranges: FloatImage
    step: FloatImage


def over_cells(combine: np.ufunc, pixels: NDArray[Any]) -> NDArray[Any]:
    """(M, N): what combine makes of the pixels (H, W) of each cell: np.logical_or, np.maximum."""
    rows, columns = (np.arange(0, length, CELL_PX) for length in pixels.shape)
    return np.asarray(combine.reduceat(combine.reduceat(pixels, rows, 0), columns, 1))


@kernel
def sum_up(disparity, coverage, first, last, low, high):
    """Write `Cells.low` and `high` of the cells that begin in rows [first, last)."""
    height, width = disparity.shape
    # Rounded up at both ends: the rows of a cell across two bands belong to the band in which it begins.
    for v in range(-(-first // CELL_PX), -(-last // CELL_PX)):
        low[v], high[v] = np.inf, -np.inf
        for y in range(v * CELL_PX, min((v + 1) * CELL_PX, height)):
            for x in range(width):
                # Range of the cell; NaN, which differs from itself, is no surface.
                d, u = disparity[y, x], x // CELL_PX
                if coverage[y, x] > 0 and d == d:
                    low[v, u], high[v, u] = min(low[v, u], d), max(high[v, u], d)


@kernel
def largest_steps(disparity, first, last, step):
    """Write `Cells.step` of the cells that begin in rows [first, last)."""
    height, width = disparity.shape
    for v in range(-(-first // CELL_PX), -(-last // CELL_PX)):
        step[v] = 0.0
        for y in range(v * CELL_PX, min((v + 1) * CELL_PX, height)):
            for x in range(width):
                # The border counts as a step: nobody knows what lies beyond.
                largest = np.float32(np.inf)
                if 0 < y < height - 1 and 0 < x < width - 1:
                    here = disparity[y, x]
                    across = max(abs(disparity[y, x - 1] - here), abs(disparity[y, x + 1] - here))
                    down = max(abs(disparity[y - 1, x] - here), abs(disparity[y + 1, x] - here))
                    # NaN, no surface, makes one of both sums NaN.
                    around = disparity[y, x - 1] + disparity[y, x + 1] + disparity[y - 1, x] + disparity[y + 1, x]
                    largest = max(across, down) if here + around == here + around else np.float32(np.inf)
                u = x // CELL_PX
                step[v, u] = max(step[v, u], largest)
