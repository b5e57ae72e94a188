"""Heights, slopes and ramps of a map along a line across a depth edge."""

from __future__ import annotations

from math import ceil

import numpy as np

from iibr_core.runtime.kernels import kernel

GAUSSIAN_SIGMAS = 3.0
"""Distance at which a Gaussian ends, in standard deviations."""
PLATEAU_SIGMAS = 2.0
"""Distance from the middle of a blurred step to the plateaus beside it, in standard deviations of the blur."""
FLAT_SHARE = 0.15
"""Largest slope of a plateau, as a share of the steepest slope of the ramp beside it."""
RAMP_END_SHARE = 0.08
"""Slope at which a ramp ends, as a share of its steepest slope."""


@kernel
def height_at(values, x, y):
    """Return the map at a real position: bilinear, and the border's pixels continue outside."""
    height, width = values.shape
    x, y = min(max(x, 0.0), width - 1.0), min(max(y, 0.0), height - 1.0)
    left, top = min(int(x), width - 2), min(int(y), height - 2)
    u, v = x - left, y - top
    above = values[top, left] * (1.0 - u) + values[top, left + 1] * u
    below = values[top + 1, left] * (1.0 - u) + values[top + 1, left + 1] * u
    return above * (1.0 - v) + below * v


@kernel
def is_inside(values, x, y):
    """Return whether a real position lies between the centres of the map's outermost pixels."""
    return 0 <= x <= values.shape[1] - 1 and 0 <= y <= values.shape[0] - 1


@kernel
def passes(values, x, y, across, down, near, far, sign, level):
    """Return whether the map is above (sign 1) or below (-1) a level somewhere between two distances from (x, y).

    True if the line leaves the map.
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
    """Return the gradient (x, y) of the map around a pixel, over 5 x 5 pixels."""
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
    """Walk from (x, y) up (sign 1) or down (-1) a ramp; return (length, value at its end, steepest slope, its place).

    reach: number of steps at most. pace: length of a step in pixels. beyond: distance past the steepest place at which
    the walk ends, in pixels.
    """
    before, steepest, last, steepest_at = height_at(values, x, y), 0.0, 0.0, 0.0
    for k in range(1, reach + 1):
        far = sign * k * pace
        value = height_at(values, x + far * across, y + far * down)
        slope = (value - before) * sign / pace
        has_levelled = slope < 0.5 * steepest and slope > 0.85 * last
        # The plateau: nearly flat, or no longer rising, or levelled off on a slanted surface, or too far past the edge.
        if slope <= RAMP_END_SHARE * steepest or slope <= 0 or has_levelled or (k - 1) * pace > steepest_at + beyond:
            return (k - 1) * pace, before, steepest, steepest_at
        if slope > steepest:
            steepest, steepest_at = slope, (k - 0.5) * pace
        last, before = slope, value
    return reach * pace, before, steepest, steepest_at
