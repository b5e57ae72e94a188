"""Where surfaces go that leave the photo's frame: along their outlines, as these run just inside."""

from __future__ import annotations

from math import ceil, exp, floor

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime.jit import kernel
from iibr_core.types import FloatImage, Margins, image_size

TRACED_PX, LEAST_PX = 10, 4
"""Outlines are followed so far inwards, and count if they can be at least so far."""
MOST_SLANT = 4
"""They may run so many pixels along the frame for each away from it."""
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
        places = np.arange(first, first + side.shape[1], dtype=np.int32) % count
        _follow_side(places, _outline_slopes(side, one_surface), around, before, rows)
        beyond[::-1] = rows
        first += side.shape[1] - 1
    return continued


@kernel
def _outline_slopes(side, one_surface):
    """(L,): how many pixels surfaces go to the right, for each out of the frame; 0 in its corners.

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
    slopes = _spread(slopes) / (_spread(weights) + STRAIGHT)
    slopes[0] = slopes[length - 1] = 0.0
    return slopes


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
