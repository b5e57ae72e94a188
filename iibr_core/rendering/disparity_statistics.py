"""What lies around every source ray: the disparities next to it, and how soft the depth edges of the whole map are.

Made once for a ray set; views look it up. Soft edges tell an estimated or enlarged map from an exact one.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime.jit import kernel
from iibr_core.runtime.tiling import ShouldStop, in_bands, never
from iibr_core.surfaces import EDGE_PX, SLOPE_SHARE, step_of
from iibr_core.types import FloatImage, image_size

STATISTICS_PX = 2
"""Reach of the range of disparities, and of the largest step, around a source ray."""
EDGE_WINDOW_PX = 8
"""A depth edge softer than this is a slope; rays this close to the middle of a soft edge are marked."""
SOFT_EDGES_PX = (8, 12)
"""Widths of the soft edges that are looked for; the wider one is for a blur of 4 px and more."""
SHARP_STEP_SHARE = 0.5
"""An edge whose largest step makes up this share of its steps is sharp."""


class DisparityStatistics(NamedTuple):
    """Of S source images. low, high (S, H, W): least and greatest disparity within STATISTICS_PX of each ray. step
    (S, H, W): the largest step between neighbours there; all px per view step, 0 where nothing is.
    softness: 0..1, of the photo's depth edges: 0 where each is one step, near 1 where they are slopes. soft (H, W):
    the photo's rays near a soft edge.
    """

    low: FloatImage
    high: FloatImage
    step: FloatImage
    softness: float
    soft: NDArray[np.bool_]


def measure_disparity(
    disparity: FloatImage, farthest_views: float, should_stop: ShouldStop = never
) -> DisparityStatistics:
    """Statistics of source images (S, H, W), the photo's first. farthest_views: the largest view offset rendered.

    Raises Cancelled once should_stop is true.
    """
    low, high, step = (np.empty(disparity.shape, np.float32) for _ in range(3))
    for source, *found in zip(disparity, low, high, step):
        _measure_rows(source, found, should_stop)
    soft, softness = find_soft_edges(disparity[0], step_of(EDGE_PX, farthest_views), should_stop)
    return DisparityStatistics(low, high, step, softness, soft)


def _measure_rows(disparity: FloatImage, found: list[FloatImage], should_stop: ShouldStop) -> None:
    in_bands(lambda first, last: _window_extremes(disparity, first, last, *found), image_size(disparity), should_stop)


def find_soft_edges(
    disparity: FloatImage, least_edge: float, should_stop: ShouldStop = never
) -> tuple[NDArray[np.bool_], float]:
    """Which rays (H, W) lie near a soft depth edge; and 0..1, the mean share of all depth edges that their largest
    step leaves to the others: 0 without edges.

    An edge: a change of at least least_edge within EDGE_WINDOW_PX along a row or a column; it counts by its change.
    Its largest step is SHARP_STEP_SHARE of it, or both its shoulders are flat: a slope that goes on is a surface.
    Raises Cancelled once should_stop is true.
    """
    left = total = 0.0
    soft = np.zeros(disparity.shape, np.bool_)
    for values, marked in ((disparity, soft), (disparity.T, soft.T)):
        changes, lefts, found = _edges(values, least_edge, should_stop)
        left += float(lefts.sum(dtype=np.float64))
        total += float(changes.sum(dtype=np.float64))
        marked |= found
    return soft, left / total if 0 < total < np.inf else 0.0


def _edges(
    values: FloatImage, least_edge: float, should_stop: ShouldStop
) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_]]:
    """Of the edges along the rows (N): the change of each, what its largest step leaves of it; and `soft` (H, W)."""
    soft = np.zeros(values.shape, np.bool_)

    def edges(first: int, last: int) -> NDArray[np.float32]:
        rows = np.ascontiguousarray(values[first:last], np.float32)
        found = np.empty((2, rows.size), np.float32)
        return found[:, : _row_edges(rows, np.float32(least_edge), *found, soft[first:last])].copy()

    found = in_bands(edges, image_size(values), should_stop)
    changes, lefts = np.concatenate([np.empty((2, 0), np.float32), *found], axis=1)
    return changes, lefts, soft


@kernel
def _rise(values, first, last):
    """From the least to the greatest of values [first, last]; NaN counts for nothing."""
    least, most = np.float32(np.inf), np.float32(-np.inf)
    for x in range(max(first, 0), min(last, len(values) - 1) + 1):
        d = values[x]
        least, most = d if d < least else least, d if d > most else most
    return most - least


@kernel
def _mark_soft(values, width, least_edge, soft):
    """Mark what lies near the middle of the soft edges of this width in one row."""
    # Half of either shoulder at least must lie in the frame.
    for x in range(width // 2, len(values) - width - width // 2):
        change = abs(values[x + width] - values[x])
        # NaN fails the comparisons.
        if not change >= least_edge:
            continue
        largest = np.float32(0.0)
        for i in range(x, x + width):
            largest = max(largest, abs(values[i + 1] - values[i]))
        if not largest < SHARP_STEP_SHARE * change:
            continue
        # Flat shoulders on both sides tell an edge from a surface.
        flat, end = SLOPE_SHARE * change, x + width
        if _rise(values, x - width, x) <= flat and _rise(values, end, end + width) <= flat:
            middle = x + width // 2
            soft[max(middle - EDGE_WINDOW_PX, 0) : middle + EDGE_WINDOW_PX + 1] = True


@kernel
def _row_edges(rows, least_edge, changes, lefts, soft):
    """Writes what `_edges` returns; returns how many edges there are."""
    count = 0
    for y in range(rows.shape[0]):
        for width in SOFT_EDGES_PX:
            _mark_soft(rows[y], width, least_edge, soft[y])
        for x in range(rows.shape[1] - EDGE_WINDOW_PX):
            # Is there an edge across the window? NaN fails the comparison.
            change = abs(rows[y, x + EDGE_WINDOW_PX] - rows[y, x])
            if not change >= least_edge:
                continue
            # A sharp edge is one step, which leaves nothing; a slope leaves most of it.
            largest = every = np.float32(0.0)
            is_known = True
            for i in range(EDGE_WINDOW_PX):
                step = abs(rows[y, x + i + 1] - rows[y, x + i])
                largest, every = max(largest, step), every + step
                is_known &= step == step
            left = change - largest
            # A slope that is no soft edge is a surface.
            if is_known and largest < SHARP_STEP_SHARE * every and not soft[y, x + EDGE_WINDOW_PX // 2]:
                continue
            changes[count] = change
            lefts[count] = left if is_known and left > 0 else np.float32(0.0)
            count += 1
    return count


@kernel
def _window_extremes(disparity, first, last, low, high, step):
    """Rows [first, last) of the range, and of the largest step, within a square: along rows first, then columns."""
    height, width = disparity.shape
    top, bottom = max(first - STATISTICS_PX, 0), min(last + STATISTICS_PX, height)
    row_low, row_high = np.empty((bottom - top, width), np.float32), np.empty((bottom - top, width), np.float32)
    row_step, row_rise = np.empty((bottom - top, width), np.float32), np.empty((bottom - top, width), np.float32)
    _extremes_along_rows(disparity, top, row_low, row_high, row_step, row_rise)
    _extremes_along_columns(row_low, row_high, row_step, row_rise, top, first, last, low, high, step)


@kernel
def _extremes_along_rows(disparity, top, low, high, step, rise):
    """Rows from top on, within some columns to both sides: range, largest step along the row, largest step down to it.

    NaN lies around the frame, as where nothing is: it is neither less nor greater than anything.
    """
    width = disparity.shape[1]
    here = np.full(width + 2 * STATISTICS_PX, np.nan, np.float32)
    above = np.full(width + 2 * STATISTICS_PX, np.nan, np.float32)
    for row in range(len(low)):
        here[STATISTICS_PX : STATISTICS_PX + width] = disparity[top + row]
        if top + row > 0:
            above[STATISTICS_PX : STATISTICS_PX + width] = disparity[top + row - 1]
        for x in range(width):
            # Written out: NaN fails every comparison, where min and max might keep it.
            least, most = np.float32(np.inf), np.float32(-np.inf)
            for i in range(2 * STATISTICS_PX + 1):
                d = here[x + i]
                least, most = d if d < least else least, d if d > most else most
            widest, steepest = np.float32(0.0), np.float32(0.0)
            for i in range(2 * STATISTICS_PX):
                change = abs(here[x + i + 1] - here[x + i])
                widest = change if change > widest else widest
            for i in range(2 * STATISTICS_PX + 1):
                change = abs(here[x + i] - above[x + i])
                steepest = change if change > steepest else steepest
            low[row, x], high[row, x] = least, most
            step[row, x], rise[row, x] = widest, steepest


@kernel
def _extremes_along_columns(row_low, row_high, row_step, row_rise, top, first, last, low, high, step):
    """Rows [first, last) of low, high and step from those of the single rows, which begin at row top."""
    bottom, width = top + len(row_low), row_low.shape[1]
    for y in range(first, last):
        least_here, most_here, widest_here = low[y], high[y], step[y]
        least_here[:], most_here[:], widest_here[:] = np.inf, -np.inf, 0.0
        # Row by row, so that the inner loops run along the rows in memory.
        for v in range(max(y - STATISTICS_PX, 0), min(y + STATISTICS_PX + 1, bottom)):
            for x in range(width):
                widest_here[x] = max(widest_here[x], row_step[v - top, x])
                least_here[x] = min(least_here[x], row_low[v - top, x])
                most_here[x] = max(most_here[x], row_high[v - top, x])
            # A rise comes from the row before: that of the first row leads out of the square.
            if v > y - STATISTICS_PX:
                for x in range(width):
                    widest_here[x] = max(widest_here[x], row_rise[v - top, x])
        # Nothing near by: both 0.
        for x in range(width):
            if not least_here[x] <= most_here[x]:
                least_here[x], most_here[x] = 0.0, 0.0
