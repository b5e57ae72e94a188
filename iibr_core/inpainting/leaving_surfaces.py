"""Where surfaces go that leave the photo's frame: along their outlines, as these run just inside."""

from __future__ import annotations

from math import ceil, exp, floor

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime.jit import kernel
from iibr_core.types import FloatImage, Margins, image_size

TRACED_PX, LEAST_PX = 10, 3
"""Outlines are followed so far inwards, and count if they can be at least so far."""
MOST_SLANT = 4
"""They may run so many pixels along the frame for each away from it."""
NOTCH_PX = 4
"""What is as narrow goes on only if both its outlines do."""
ALIKE = 0.33
"""The same two surfaces meet as long as their disparities have changed by less than this share of the step."""
SPREAD_PX, STRAIGHT = 4.0, 0.05
"""Near an outline surfaces go its way: it counts exponentially less with the distance, and going straight this much."""


def follow_surfaces(disparity: FloatImage, margins: Margins, one_surface: float) -> NDArray[np.int32]:
    """(H', W'): which pixel of the frame's, numbered clockwise from the upper left, goes on where beyond it. The inside
    is not written.

    disparity: (H, W); margins: pixels added on each side of it. Steps above one_surface part two surfaces. Where
    several reach, the nearest shows.
    """
    height, width = disparity.shape
    continued = np.full(margins.around(image_size(disparity)), -1, np.int32)
    count, first = max(2 * (height + width) - 4, 1), 0
    around = np.concatenate([disparity[0, :-1], disparity[:-1, -1], disparity[-1, :0:-1], disparity[:0:-1, 0]])
    # Each side in turn is the upper one.
    for turn, before in enumerate((margins.left, margins.top, margins.right, margins.bottom)):
        side = np.ascontiguousarray(np.rot90(disparity, turn)[: TRACED_PX + 1])
        beyond = np.rot90(continued, turn)[: (margins.top, margins.right, margins.bottom, margins.left)[turn]]
        rows = np.ascontiguousarray(beyond[::-1])
        slopes, weights = _trace_outlines(side, one_surface)
        places = (first + _without_notches(side[0], weights, one_surface)) % count
        _follow_side(places, _surface_slopes(slopes, weights), around, before, rows)
        beyond[::-1] = rows
        first += side.shape[1] - 1
    return continued


@kernel
def _trace_outlines(side, one_surface):
    """(L,): how many pixels the outline between a pixel of the frame and the next goes to the right for each out of the
    frame, times its weight. (L,): the weights, 0 where there is no outline.

    side (D, L): disparity, the frame's row first.
    """
    deep, length = side.shape
    slopes, weights = np.zeros(length), np.zeros(length)
    for p in range(length - 1):
        left, right = side[0, p], side[0, p + 1]
        alike = ALIKE * abs(right - left)
        if not abs(right - left) > one_surface:
            continue
        at, steps, along, squares = p, 0, 0.0, 0.0
        for k in range(1, deep):
            # The nearest place where the same surfaces meet.
            meets = -1
            for j in range(2 * MOST_SLANT + 1):
                q = at + ((j + 1) // 2 if j % 2 else -(j // 2))
                if 0 <= q < length - 1 and abs(side[k, q] - left) < alike and abs(side[k, q + 1] - right) < alike:
                    meets = q
                    break
            if meets < 0:
                break
            at, steps = meets, k
            along += k * (at - p)
            squares += k * k
        if steps >= LEAST_PX:
            # The straight line through the outline at the frame that fits best.
            weights[p] = steps / TRACED_PX
            slopes[p] = -weights[p] * along / squares
    return slopes, weights


@kernel
def _without_notches(row, weights, one_surface):
    """(L,): the place whose surface goes on from each of the frame's: another's where its own ends just inside."""
    lasting, begin = np.arange(len(row), dtype=np.int32), 0
    for p in range(len(row) - 1):
        if abs(row[p + 1] - row[p]) > one_surface:
            # From one step to the next.
            if begin > 0 and p + 1 - begin <= NOTCH_PX and weights[begin - 1] * weights[p] == 0.0:
                lasting[begin : p + 1] = lasting[begin - 1]
            begin = p + 1
    return lasting


def _surface_slopes(slopes: NDArray[np.float64], weights: NDArray[np.float64]) -> NDArray[np.float64]:
    """(L,): how surfaces go between their outlines; straight on in the corners."""
    between = _spread(slopes) / (_spread(weights) + STRAIGHT)
    between[[0, -1]] = 0.0
    return np.asarray(between)


@kernel
def _spread(values):
    """(L,): sums of all values, less the farther away."""
    keep, sums, after = exp(-1.0 / SPREAD_PX), values.copy(), 0.0
    for p in range(1, len(values)):
        sums[p] += keep * sums[p - 1]
    for p in range(len(values) - 2, -1, -1):
        after = keep * (after + values[p + 1])
        sums[p] += after
    return sums


@kernel
def _follow_side(places, slopes, disparity, before, continued):
    """Write rows (R, C) above one side, the nearest to it first, whose places begin `before` columns from the left.

    disparity (N,): of all places of the frame.
    """
    last = len(places) - 1
    for row in range(len(continued)):
        away = row + 1
        for p in range(-1, last + 1):
            # Between two neighbours; corners go on to the end.
            left, right = max(p, 0), min(p + 1, last)
            here = before + left + slopes[left] * away if p >= 0 else 0.0
            there = before + right + slopes[right] * away if p < last else continued.shape[1] - 1.0
            # Where they have changed places, others came between.
            for column in range(max(ceil(here), 0), min(floor(there) + 1, continued.shape[1])):
                place = places[left if column - here < there - column else right]
                was = continued[row, column]
                if was < 0 or disparity[place] > disparity[was]:
                    continued[row, column] = place
