"""What lies around every source ray: the disparities next to it, and how soft the depth edges of the whole map are.

Made once for a ray set; views look it up. Soft edges tell an estimated or enlarged map from an exact one.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from iibr_core.kernels import kernel
from iibr_core.types import FloatImage

AROUND_PX = 2
"""Reach of the range of disparities around a source ray."""
STEP_AROUND_PX = 3
"""Reach of the search for a depth edge."""
EDGE_WINDOW_PX = 8
"""A depth edge softer than this is a slope."""
EDGE_PARALLAX_PX = 2.0
"""Least parallax, in the outermost view, of the edges whose softness is measured."""


@dataclass(frozen=True, eq=False)
class Surroundings:
    """Of S source images. low, high (S, H, W): least and greatest disparity within AROUND_PX of each ray. step
    (S, H, W): the largest step between neighbours within STEP_AROUND_PX; all px per view step, 0 where nothing is.
    softness: 0..1, of the photo's depth edges: 0 where each is one step, near 1 where they are slopes.
    """

    low: FloatImage
    high: FloatImage
    step: FloatImage
    softness: float


def surroundings_of(disparity: FloatImage, farthest_views: float) -> Surroundings:
    """Surroundings of source images (S, H, W), the photo's first. farthest_views: the largest view offset rendered."""
    low, high, step = (np.zeros_like(disparity) for _ in range(3))
    for k in range(len(disparity)):
        _around(disparity[k], low[k], high[k], step[k])
    return Surroundings(low, high, step, edge_softness(disparity[0], EDGE_PARALLAX_PX / max(farthest_views, 1e-9)))


def edge_softness(disparity: FloatImage, least_edge: float) -> float:
    """0..1: the mean share of the depth edges (H, W) that their largest step leaves to the others; 0 without edges.

    An edge: a change of at least least_edge within EDGE_WINDOW_PX along a row or a column; it counts by its change.
    """
    left = total = 0.0
    for values in (disparity, disparity.T):
        if values.shape[1] <= EDGE_WINDOW_PX:
            continue
        with np.errstate(invalid="ignore"):
            steps = np.abs(np.diff(values, axis=1))
            change = np.abs(values[:, EDGE_WINDOW_PX:] - values[:, :-EDGE_WINDOW_PX])
            largest = np.lib.stride_tricks.sliding_window_view(steps, EDGE_WINDOW_PX, axis=1).max(axis=-1)
            is_edge = change >= least_edge
        left += float(np.fmax(change - largest, 0)[is_edge].sum(dtype=np.float64))
        total += float(change[is_edge].sum(dtype=np.float64))
    return left / total if 0 < total < np.inf else 0.0


@kernel
def _around(disparity, low, high, step):  # type: ignore[no-untyped-def]
    """Rows first, then columns: the range, and the largest step, within a square."""
    height, width = disparity.shape
    row_low, row_high = np.empty((height, width), np.float32), np.empty((height, width), np.float32)
    row_step, row_rise = np.empty((height, width), np.float32), np.empty((height, width), np.float32)
    for y in range(height):
        for x in range(width):
            least, most, widest, steepest = np.inf, -np.inf, 0.0, 0.0
            for u in range(max(x - STEP_AROUND_PX, 0), min(x + STEP_AROUND_PX + 1, width)):
                d = disparity[y, u]
                if abs(u - x) <= AROUND_PX:
                    least, most = min(least, d), max(most, d)
                if u > x - STEP_AROUND_PX and u > 0:
                    change = abs(d - disparity[y, u - 1])
                    if change > widest:
                        widest = change
                if y > 0:
                    change = abs(d - disparity[y - 1, u])
                    if change > steepest:
                        steepest = change
            row_low[y, x], row_high[y, x], row_step[y, x], row_rise[y, x] = least, most, widest, steepest
    for y in range(height):
        for x in range(width):
            least, most, widest = np.inf, -np.inf, 0.0
            for v in range(max(y - STEP_AROUND_PX, 0), min(y + STEP_AROUND_PX + 1, height)):
                if abs(v - y) <= AROUND_PX:
                    least, most = min(least, row_low[v, x]), max(most, row_high[v, x])
                if row_step[v, x] > widest:
                    widest = row_step[v, x]
                if v > y - STEP_AROUND_PX and row_rise[v, x] > widest:
                    widest = row_rise[v, x]
            if least <= most:
                low[y, x], high[y, x] = least, most
            step[y, x] = widest
