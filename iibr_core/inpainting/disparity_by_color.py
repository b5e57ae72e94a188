"""Unknown disparity, filled by the photo: each pixel takes the disparity of similar pixels around it.

Filling from the background side, which is safe without a photo, would tear borders and wires off their surfaces.
"""

from __future__ import annotations

from math import exp

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.disparity_holes import fill_disparity_holes
from iibr_core.runtime import tiling
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_pieces, pieces_of
from iibr_core.types import FloatImage


def nearness(reach_px: int, spread_px: float) -> NDArray[np.float64]:
    """Return Gaussian weights (2 reach_px + 1, 2 reach_px + 1) by the distance from the middle, where it is 1."""
    steps = np.arange(-reach_px, reach_px + 1)
    return np.asarray(np.exp(-0.5 * (steps[:, None] ** 2 + steps**2) / spread_px**2))


VOTE_REACH_PX = 4
"""Distance of voting pixels in each direction, in pixels."""
SPREAD_PX = 2.0
"""Standard deviation of the weight by distance, in pixels."""
VOTE_NEARNESS = nearness(VOTE_REACH_PX, SPREAD_PX)
COLOR_SIGMA = 0.04
"""Standard deviation of the weight by colour (sRGB-encoded, all channels together)."""
UNLIKE_WEIGHT = 1e-3
"""Weight of a pixel of an entirely different colour: without similar pixels, the nearest decide."""
VOTE_BINS = 24
"""Number of bins that the range of the disparities around a pixel is divided into."""
SIDE_BINS = 0.7
"""Weight of the two bins beside a bin in its sum of votes."""
MAX_VOTE_ROUNDS = 64
"""Distance from all known pixels, in pixels, beyond which pixels are filled from the background side."""
MAX_VOTED_PIXELS_AT_ONCE = 1 << 12


def fill_disparity_by_color(photo: FloatImage, values: FloatImage) -> FloatImage:
    """Replace the NaN of a disparity map (H, W) by means of the photo (H, W, 3), sRGB-encoded; known values stay.

    From the known values inwards, each pixel takes the disparity with most votes of the pixels around it, weighted by
    nearness and similarity (a bilateral mode filter); filled pixels vote in the next round. All results lie within the
    known values. Raises ValueError if nothing is known.
    """
    filled, colors = np.array(values, np.float32, order="C"), np.ascontiguousarray(photo, np.float32)
    pixels = _beside_known(filled)
    for _ in range(MAX_VOTE_ROUNDS):
        if not len(pixels):
            break
        parts = [pixels[part] for part in pieces_of(len(pixels), MAX_VOTED_PIXELS_AT_ONCE)]
        votes = in_pieces(lambda part: _vote(colors, filled, part), parts, tiling.THREADS)
        filled.reshape(-1)[pixels] = np.concatenate(votes)
        pixels = _unknown_around(filled, pixels)
    return fill_disparity_holes(filled)


def _beside_known(values: FloatImage) -> NDArray[np.int64]:
    """Return the unknown pixels (flat indices) with a known one among their eight neighbours."""
    known = np.pad(~np.isnan(values), 1)
    near = known[:-2] | known[1:-1] | known[2:]
    near = near[:, :-2] | near[:, 1:-1] | near[:, 2:]
    return np.flatnonzero(near & np.isnan(values))


def _unknown_around(values: FloatImage, pixels: NDArray[np.int64]) -> NDArray[np.int64]:
    """Return the unknown pixels (flat indices) among the eight neighbours of these."""
    (height, width), (y, x) = values.shape, np.divmod(pixels, values.shape[1])
    rows = [np.clip(y + step, 0, height - 1) * width for step in (-1, 0, 1)]
    columns = [np.clip(x + step, 0, width - 1) for step in (-1, 0, 1)]
    around = np.concatenate([row + column for row in rows for column in columns])
    return np.unique(around[np.isnan(np.take(values, around))])


@kernel
def _vote(colors, values, pixels):
    """Return the disparities (N) for pixels (flat indices) from the known ones around them; there is at least one."""
    height, width = values.shape
    result, bins, weight = np.empty(len(pixels), np.float32), np.empty(VOTE_BINS), np.empty(VOTE_NEARNESS.shape)
    for n in range(len(pixels)):
        y, x = pixels[n] // width, pixels[n] % width
        top, bottom = max(y - VOTE_REACH_PX, 0), min(y + VOTE_REACH_PX + 1, height)
        left, right = max(x - VOTE_REACH_PX, 0), min(x + VOTE_REACH_PX + 1, width)
        low, high = np.inf, -np.inf
        for v in range(top, bottom):
            for u in range(left, right):
                d = np.float64(values[v, u])
                if d == d:  # NaN differs from itself
                    low, high = min(low, d), max(high, d)
        # A histogram of votes; all are in one bin if there is one disparity only.
        scale = (VOTE_BINS - 1) / (high - low) if high > low else 0.0
        bins[:] = 0.0
        for v in range(top, bottom):
            for u in range(left, right):
                d = np.float64(values[v, u])
                if d != d:
                    continue
                apart = 0.0
                for c in range(3):
                    apart += (colors[v, u, c] - colors[y, x, c]) ** 2
                likeness = exp(-0.5 * apart / (COLOR_SIGMA * COLOR_SIGMA))
                w = (likeness + UNLIKE_WEIGHT) * VOTE_NEARNESS[v - y + VOTE_REACH_PX, u - x + VOTE_REACH_PX]
                weight[v - top, u - left] = w
                bins[int((d - low) * scale)] += w
        # Its mode; neighbouring bins count too, because a surface may lie across the border of two.
        elected, most = 0, -1.0
        for k in range(VOTE_BINS):
            votes = bins[k] + SIDE_BINS * (
                bins[max(k - 1, 0)] * (k > 0) + bins[min(k + 1, VOTE_BINS - 1)] * (k < VOTE_BINS - 1)
            )
            if votes > most:
                elected, most = k, votes
        # The mean of those that voted for it.
        total = weights = 0.0
        for v in range(top, bottom):
            for u in range(left, right):
                d = np.float64(values[v, u])
                if d == d and abs(int((d - low) * scale) - elected) <= 1:
                    w = weight[v - top, u - left]
                    total, weights = total + w * (d - low), weights + w
        result[n] = min(low + total / weights, high)
    return result
