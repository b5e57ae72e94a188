"""The place of a small map's values in its photo: the middle of the blocks of pixels, or their upper left corners.

Averages lie in the middle, maps that were made smaller by leaving out pixels at the corners.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from iibr_core.depth.edges.blur import EDGE_SIGMAS, MEASURED_EDGE
from iibr_core.depth.edges.line import gradient, height_at
from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage

CERTAINTY = 3.0
"""Number of standard errors, above zero, of a mean vote that counts."""


def lies_at_corners(photo: FloatImage, values: FloatImage) -> bool:
    """Return whether a map's edges fit those of its photo better at the corners of its pixels than in their middles.

    photo: (H, W, 3). values: (h, w), NaN unknown.
    """
    enlargement = photo.shape[0] / max(values.shape[0], 1), photo.shape[1] / max(values.shape[1], 1)
    if min(values.shape) < 5 or min(enlargement) <= 1 or not np.isfinite(values).any():
        return False
    low, high = np.nanpercentile(values, (2, 98))
    if not high > low:
        return False
    # A step of this height, blurred by a pixel.
    min_slope = MEASURED_EDGE * (high - low) / EDGE_SIGMAS
    vote, square = _vote(photo, np.ascontiguousarray(values, np.float32), *enlargement, min_slope)
    return bool(vote > CERTAINTY * sqrt(square))


@kernel
def _contrast(photo, x, y, across, down):
    """Return the difference of colour between both sides of a place, at this distance."""
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
def _vote(photo, values, scale_y, scale_x, min_slope):
    """Return the sum of the votes of the steepest pixels of edges, and that of their squares.

    A vote is how much more contrast the photo has at the corner than in the middle, -1..1.
    """
    height, width = values.shape
    vote = square = 0.0
    for y in range(2, height - 2):
        for x in range(2, width - 2):
            across, down = gradient(values, x, y)
            slope = sqrt(across * across + down * down)
            if not slope > min_slope:
                continue
            right, under = across / slope, down / slope
            before = _slope(values, x - round(right), y - round(under))
            after = _slope(values, x + round(right), y + round(under))
            if not max(before, after) <= slope:
                continue
            far_x, far_y = 0.5 * right * scale_x, 0.5 * under * scale_y
            middle = _contrast(photo, (x + 0.5) * scale_x - 0.5, (y + 0.5) * scale_y - 0.5, far_x, far_y)
            corner = _contrast(photo, x * scale_x, y * scale_y, far_x, far_y)
            if middle + corner > 0:
                share = (corner - middle) / (corner + middle)
                vote, square = vote + share, square + share * share
    return vote, square
