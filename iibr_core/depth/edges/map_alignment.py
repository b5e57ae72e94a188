"""Where the values of a small map lie in its photo: in the middle of the blocks of pixels that they stand for, as
averages do, or at their upper left corners, as in maps that were made smaller by leaving out pixels.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from iibr_core.depth.edges.edge_profiles import gradient, height_at
from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage

LEAST_ENLARGEMENT = 1.25
"""Below, both places are the same."""
LEAST_EDGE = 0.1
"""Edges that tell are at least so high, relative to the map's range."""
RAMP_PX = 2.5
"""A step is as high as its slope over 5 x 5 pixels times this."""
LEAST_VOTE, CERTAINTY = 0.02, 3.0
"""Mean share of contrast that edges have more at corners than in the middles, and in standard errors, from which the
map lies there.
"""


def lies_at_corners(photo: FloatImage, values: FloatImage) -> bool:
    """Whether edges of a map (h, w), NaN unknown, fit those of its photo (H, W, 3) at the corners of its pixels rather
    than in their middles.
    """
    if min(values.shape) < 5 or min(photo.shape[:2]) < 5:
        return False
    enlargement = photo.shape[0] / values.shape[0], photo.shape[1] / values.shape[1]
    low, high = np.nanpercentile(values, (2, 98)) if np.isfinite(values).any() else (0.0, 0.0)
    if min(enlargement) < LEAST_ENLARGEMENT or not high > low:
        return False
    least_slope = LEAST_EDGE * (high - low) / RAMP_PX
    vote, square, count = _vote(photo, np.ascontiguousarray(values, np.float32), *enlargement, least_slope)
    return bool(count and vote > LEAST_VOTE * count and vote > CERTAINTY * sqrt(square))


@kernel
def _contrast(photo, x, y, across, down):
    """How much the photo's colour differs on both sides of a place, so far away."""
    total = 0.0
    for c in range(3):
        channel = photo[:, :, c]
        total += (height_at(channel, x + across, y + down) - height_at(channel, x - across, y - down)) ** 2
    return sqrt(total)


@kernel
def _slope(values, x, y):
    across, down = gradient(values, x, y)
    return sqrt(across * across + down * down)


@kernel
def _vote(photo, values, scale_y, scale_x, least_slope):
    """How much more contrast the photo has at corners, -1..1: sums over the steepest pixels of edges of that, of its
    square, and of 1.
    """
    height, width = values.shape
    vote, square, count = 0.0, 0.0, 0
    for y in range(2, height - 2):
        for x in range(2, width - 2):
            across, down = gradient(values, x, y)
            slope = sqrt(across * across + down * down)
            if not slope > least_slope:
                continue
            right, under = across / slope, down / slope
            if not (
                _slope(values, x - round(right), y - round(under)) <= slope
                and _slope(values, x + round(right), y + round(under)) <= slope
            ):
                continue
            # Half a pixel of the map to both sides.
            far_x, far_y = 0.5 * right * scale_x, 0.5 * under * scale_y
            middle = _contrast(photo, (x + 0.5) * scale_x - 0.5, (y + 0.5) * scale_y - 0.5, far_x, far_y)
            corner = _contrast(photo, x * scale_x, y * scale_y, far_x, far_y)
            if middle + corner > 0:
                share = (corner - middle) / (corner + middle)
                vote, square, count = vote + share, square + share * share, count + 1
    return vote, square, count
