"""Unknown disparity, filled from its background side: what a camera could not see lies behind what it saw beside it."""

from __future__ import annotations

import math

import numpy as np

from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.types import FloatImage

# Lines through a pixel: falling diagonal, vertical, rising diagonal, horizontal; the length of one step along each. The
# horizontal counts half: cameras of a stereo rig stand side by side, so their blind spots end left and right.
STEP_LENGTHS = (math.sqrt(2), 1.0, math.sqrt(2), 0.5)
# A hole that is open on a line, up to the frame, counts as this many times as wide as what is known of it.
OPEN_LINE = 12
# How strongly the line with the shortest way across the hole prevails. 8 was best of 2, 4, 8 on four scenes.
SHORTNESS = 8


def fill_disparity_holes(values: FloatImage) -> FloatImage:
    """Replace the NaN of an (H, W) disparity map; known values stay as they are.

    On each of four lines through an unknown pixel, the farther (smaller) of the two nearest known values counts; the
    lines are averaged by 1 / span**8, span being the way across the hole. Lines on which the hole reaches the frame
    have one end only and count little. All results lie within the known values.
    Raises ValueError if nothing is known.
    """
    filled = np.array(values, np.float32, order="C")
    unknown = np.isnan(filled)
    if unknown.all():
        raise ValueError("no known value to fill from")
    while (count := int(unknown.sum())) > 0:
        near = np.empty((2, count, 4), np.float32)
        steps = np.empty((2, count, 4), np.int32)
        raise_if_stopped()
        _nearest_before(filled, near[0], steps[0])
        raise_if_stopped()
        # The same, seen from the last pixel: everything that comes after.
        _nearest_before(filled[::-1, ::-1], near[1, ::-1], steps[1, ::-1])
        raise_if_stopped()
        filled[unknown] = _farther_side(near, steps, np.array(STEP_LENGTHS))
        unknown = np.isnan(filled)  # pixels with no known value on any line; the second round reaches them
    return filled


def say_filled(name: str, unknown: float) -> str:
    """A sentence on a map of which this share, above 0, was filled."""
    if unknown > 0.9:
        return f"Only {100 * (1 - unknown):.2g} % of {name} is known; what is unknown was filled from around it."
    return f"{100 * unknown:.2g} % of {name} is unknown and was filled from around it."


@kernel
def _nearest_before(values, near, steps):
    """For the n-th NaN of values (H, W) in reading order: near[n, k], the nearest known value that precedes it on line
    k, NaN if there is none, and steps[n, k], how many pixels away it is.
    """
    height, width = values.shape
    # Per column, with a margin of one: what the row above saw last, looking up-left, up and up-right.
    above = np.full((3, width + 2), np.nan, np.float32)
    above_steps = np.zeros((3, width + 2), np.int32)
    row = above.copy()
    row_steps = above_steps.copy()
    count = 0
    for y in range(height):
        left = np.float32(np.nan)
        left_steps = 0
        for x in range(width):
            value = values[y, x]
            # A known value is the nearest for whoever comes next, on all lines.
            if not math.isnan(value):
                left, left_steps = value, 0
                for k in range(3):
                    row[k, x + 1] = value
                    row_steps[k, x + 1] = 0
                continue
            # Each unknown pixel inherits what its predecessor on the line saw, one step farther away.
            left_steps += 1
            for k in range(3):
                row[k, x + 1] = above[k, x + k]
                row_steps[k, x + 1] = above_steps[k, x + k] + 1
                near[count, k] = row[k, x + 1]
                steps[count, k] = row_steps[k, x + 1]
            near[count, 3] = left
            steps[count, 3] = left_steps
            count += 1
        # Swapped, not copied: the next row overwrites what was above.
        above, row = row, above
        above_steps, row_steps = row_steps, above_steps


@kernel
def _farther_side(near, steps, step_lengths):
    """Fill values (N,) from the known ends (2, N, 4) of the lines; NaN where no line has a known end."""
    filled = np.empty(near.shape[1], np.float32)
    spans = np.empty(4)
    farther = np.empty(4)
    for n in range(near.shape[1]):
        for k in range(4):
            # A line with one end: the hole is open there, up to the frame. With none: nothing.
            before, after = near[0, n, k], near[1, n, k]
            if math.isnan(before) or math.isnan(after):
                farther[k] = after if math.isnan(before) else before
                spans[k] = OPEN_LINE * step_lengths[k] * (steps[1, n, k] if math.isnan(before) else steps[0, n, k])
            else:
                # Two ends: the background is the farther one; the way across the hole is the line's span.
                farther[k] = min(before, after)
                spans[k] = step_lengths[k] * (steps[0, n, k] + steps[1, n, k])
            if math.isnan(farther[k]):
                spans[k] = np.inf
        shortest = spans.min()
        total, weights = 0.0, 0.0
        for k in range(4):
            if spans[k] < np.inf:
                # Relative to the shortest, so that no power overflows.
                weight = (shortest / spans[k]) ** SHORTNESS
                total += weight * farther[k]
                weights += weight
        filled[n] = total / weights if weights > 0 else np.nan
    return filled
