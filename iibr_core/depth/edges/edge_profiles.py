"""A disparity map and its photo along a line through an edge: heights, slopes, and where the photo changes."""

from __future__ import annotations

from math import ceil, floor

import numpy as np

from iibr_core.runtime.jit import kernel

GAUSSIAN_SIGMAS = 3.0
"""Where a Gaussian ends."""
PLATEAU_SIGMAS = 2.0
"""From the middle of a blurred step, or from where a blurred structure ended, to the plateaus beside it."""
FLAT_SHARE = 0.15
"""What changes by no more than this share of a step beside it is flat."""
COLOR_NOISE = 0.003
"""Squared distance of colours (sRGB-encoded) that tells nothing."""
FLATNESS = 0.08
"""A ramp ends where its slope falls below this share of its steepest."""


@kernel
def height_at(values, x, y):
    """The map at a real position, bilinear; its border pixels continue outside."""
    height, width = values.shape
    # The last cell of pixels is used up to its far end: both taps exist even there.
    x, y = min(max(x, 0.0), width - 1.0), min(max(y, 0.0), height - 1.0)
    left, top = min(int(x), width - 2), min(int(y), height - 2)
    u, v = x - left, y - top
    # Unsigned indices need no test for counting from the end.
    left, top = np.uint64(left), np.uint64(top)
    right, under = left + np.uint64(1), top + np.uint64(1)
    above = values[top, left] * (1.0 - u) + values[top, right] * u
    below = values[under, left] * (1.0 - u) + values[under, right] * u
    return above * (1.0 - v) + below * v


@kernel
def is_inside(values, x, y):
    """Whether a real position lies between the centres of the map's outermost pixels."""
    return 0 <= x <= values.shape[1] - 1 and 0 <= y <= values.shape[0] - 1


@kernel
def passes(values, x, y, across, down, near, far, sign, level):
    """Whether the map is above (sign 1) or below (-1) a level somewhere between these distances from (x, y); outside
    the map it may be.
    """
    if not is_inside(values, x + across * far, y + down * far):
        return True
    for k in range(ceil(far - near) + 1):
        at = min(near + k, far)
        if sign * (height_at(values, x + across * at, y + down * at) - level) > 0:
            return True
    return False


@kernel
def gradient(values, x, y):
    """Gradient (x, y) of the map about a pixel, over 5 x 5."""
    height, width = values.shape
    across = down = 0.0
    # Separable: binomial smoothing (1 4 6 4 1) along one axis, smoothed differences (-1 -2 0 2 1) along the other.
    for j in range(-2, 3):
        row = min(max(y + j, 0), height - 1)
        smooth_j = (6.0 if j == 0 else 4.0 if abs(j) == 1 else 1.0) / 16.0
        slope_j = (2.0 if abs(j) == 1 else 1.0) * np.sign(j) / 8.0
        for i in range(-2, 3):
            value = values[row, min(max(x + i, 0), width - 1)]
            smooth_i = (6.0 if i == 0 else 4.0 if abs(i) == 1 else 1.0) / 16.0
            slope_i = (2.0 if abs(i) == 1 else 1.0) * np.sign(i) / 8.0
            across += smooth_j * slope_i * value
            down += slope_j * smooth_i * value
    return across, down


@kernel
def walk(values, x, y, across, down, sign, reach, pace, beyond):
    """From (x, y) up (sign 1) or down (-1) the ramp: (length, value at its end, slope there, steepest slope, where).

    reach: at most so many steps; pace: of so many pixels; beyond: no farther than that past the steepest place, px.
    """
    before, steepest, slope, last, steepest_at = height_at(values, x, y), 0.0, 0.0, 0.0, 0.0
    # A march along the gradient, one sample a step.
    for k in range(1, reach + 1):
        far = sign * k * pace
        value = height_at(values, x + far * across, y + far * down)
        # Rise a pixel since the last sample, positive both ways along the ramp.
        slope = (value - before) * sign / pace
        levelled = slope < 0.5 * steepest and slope > 0.85 * last
        # The plateau: nearly flat, or no longer rising, or levelled off on a slanted surface, or too far past the edge.
        if slope <= FLATNESS * steepest or slope <= 0 or levelled or (k - 1) * pace > steepest_at + beyond:
            return (k - 1) * pace, before, slope, steepest, steepest_at
        if slope > steepest:
            steepest, steepest_at = slope, (k - 0.5) * pace
        last, before = slope, value
    return reach * pace, before, slope, steepest, steepest_at


@kernel
def strongest_change(photo, x, y, across, down, first, last):
    """Greatest squared change of the photo's colour over 2 px of the line through (x, y), between those distances."""
    height, width = photo.shape[:2]
    strongest = 0.0
    for k in range(floor(last - first) + 1):
        at = first + k
        # The pixels nearest to one pixel before and one after.
        x0 = min(max(floor(x + across * (at - 1) + 0.5), 0), width - 1)
        y0 = min(max(floor(y + down * (at - 1) + 0.5), 0), height - 1)
        x1 = min(max(floor(x + across * (at + 1) + 0.5), 0), width - 1)
        y1 = min(max(floor(y + down * (at + 1) + 0.5), 0), height - 1)
        change = 0.0
        for c in range(3):
            change += (photo[y1, x1, c] - photo[y0, x0, c]) ** 2
        strongest = max(strongest, change)
    return strongest
