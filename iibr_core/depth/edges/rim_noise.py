"""Noise of rims: beside depth edges measured maps waver more than inside surfaces, and outlines look ragged.

What goes on along a rim is its surface; what differs from pixel to pixel, as far from the edge, is noise, as far as the
map has more of it there than inside. Round fronts, which bend away from the view all along their rims, stay round.
"""

from __future__ import annotations

from functools import partial
from math import exp

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.edges.rim_sides import RIM_PX, step_distance
from iibr_core.inpainting.disparity_by_color import nearness
from iibr_core.runtime import tiling
from iibr_core.runtime.jit import kernel
from iibr_core.runtime.tiling import ShouldStop, in_pieces, pieces_of
from iibr_core.types import FloatImage

INSIDE_PX = 3
"""Between a step and the rows of pixels, as many as in rims, that tell how much a map wavers inside its surfaces."""
REACH_PX, SPREAD_PX = 5, 2.5
"""Pixels within so many, each way, tell where a rim goes; standard deviation of their weights by distance."""
NEARNESS = nearness(REACH_PX, SPREAD_PX)
NEARNESS[REACH_PX, REACH_PX] = 0
"""Those weights, (2 REACH_PX + 1, 2 REACH_PX + 1), 0 in the middle."""
ALIKE, UNLIKE_WEIGHT = 0.1, 0.05
"""Standard deviation of their weights by colour (sRGB-encoded, all channels together); what they weigh at least."""
LEAST_WEIGHT = 0.3
"""Of all of them together, below which a rim is too short to go anywhere."""
OUTLIER = 0.7
"""Of their mean deviation, from which values count less (Huber)."""
QUARTILE = 75
"""Of deviations, per cent: how much a map wavers."""
SAMPLED = 8
"""One pixel in so many tells it."""
LEAST_SAMPLES = 20
"""Fewer tell nothing."""
LEAST_SHARE = 0.5
"""Of a rim's variance that must be noise, or it stays: smaller shares are not told exactly."""
MOST_PIECE_PIXELS = 1 << 12


def steady_rims(colors: FloatImage, values: FloatImage, step: float, should_stop: ShouldStop) -> FloatImage:
    """The map (H, W), its rims smoothed along themselves where that is noise, by the photo (H, W, 3).

    step: neighbours on one surface differ by no more. Each row of pixels beside steps moves towards its mean along the
    rim by the share of its variance that rows inside surfaces do not have (Wiener 1949), so maps whose rims are as good
    as the rest stay as they are. Raises Cancelled once should_stop is true.
    """
    distance = step_distance(values, step, INSIDE_PX + RIM_PX)
    deviations = partial(_deviations, colors, values, distance, step, should_stop)
    steadied = values.copy()
    for away in range(RIM_PX + 1):
        rim, inside = (np.flatnonzero(distance == px) for px in (away, INSIDE_PX + away))
        share = _noise_share(deviations(rim[::SAMPLED]), deviations(inside[::SAMPLED]))
        if share >= LEAST_SHARE:
            steadied.reshape(-1)[rim] -= np.float32(share) * np.nan_to_num(deviations(rim))
    return steadied


def _deviations(
    colors: FloatImage,
    values: FloatImage,
    distance: NDArray[np.uint8],
    step: float,
    should_stop: ShouldStop,
    pixels: NDArray[np.int64],
) -> FloatImage:
    """How far pixels (flat indices) are off what `_mean_along` says, (N); NaN where it says nothing."""
    parts = [pixels[part] for part in pieces_of(len(pixels), MOST_PIECE_PIXELS)]
    weigh = partial(_mean_along, colors, values, distance, step)
    means = in_pieces(weigh, parts, should_stop, tiling.THREADS)
    return np.asarray(values.reshape(-1)[pixels] - np.concatenate([*means, np.empty(0, np.float32)]))


def _noise_share(rim: FloatImage, inside: FloatImage) -> float:
    """Share of the variance of a rim's deviations that those inside surfaces do not have; NaN tells nothing."""
    rim, inside = (np.abs(off[np.isfinite(off)]) for off in (rim, inside))
    if min(len(rim), len(inside)) < LEAST_SAMPLES:
        return 0.0
    wavers, least = (float(np.percentile(off, QUARTILE)) for off in (rim, inside))
    return 1.0 - min(least / wavers, 1.0) ** 2 if wavers > 0 else 0.0


@kernel
def _mean_along(colors, values, distance, step, pixels):
    """Of pixels (N, flat indices): the mean of those around them on their surface and as far from a step, the more the
    nearer they are and the more they look alike; once more without those far off it. NaN where there are few.
    """
    height, width = values.shape
    means = np.full(len(pixels), np.float32(np.nan))
    off, weight = np.empty(NEARNESS.size), np.empty(NEARNESS.size)
    for n in range(len(pixels)):
        y, x = pixels[n] // width, pixels[n] % width
        own, away, count = values[y, x], distance[y, x], 0
        total = weights = 0.0
        for v in range(max(y - REACH_PX, 0), min(y + REACH_PX + 1, height)):
            for u in range(max(x - REACH_PX, 0), min(x + REACH_PX + 1, width)):
                if distance[v, u] == away and abs(values[v, u] - own) <= step:
                    apart = 0.0
                    for c in range(3):
                        apart += (colors[v, u, c] - colors[y, x, c]) ** 2
                    # Colours that are not finite are like no other.
                    likeness = exp(-0.5 * apart / (ALIKE * ALIKE)) if apart < np.inf else 0.0
                    w = (likeness + UNLIKE_WEIGHT) * NEARNESS[v - y + REACH_PX, u - x + REACH_PX]
                    off[count], weight[count], count = values[v, u] - own, w, count + 1
                    total, weights = total + w * (values[v, u] - own), weights + w
        if weights < LEAST_WEIGHT:
            continue
        mean, deviation = total / weights, 0.0
        for k in range(count):
            deviation += weight[k] * abs(off[k] - mean)
        limit = OUTLIER * deviation / weights
        total = weights = 0.0
        for k in range(count):
            far = abs(off[k] - mean)
            w = weight[k] * (limit / far if far > limit else 1.0)
            total, weights = total + w * off[k], weights + w
        means[n] = own + total / weights
    return means
