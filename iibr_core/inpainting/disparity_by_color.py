"""Unknown disparity, filled by the photo: each pixel goes with those around it that look like it.

The background side, which is the safe guess where nothing else is known, tears borders and wires off their surfaces.
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
    """(2 reach_px + 1, 2 reach_px + 1): weights of pixels by their distance from the one in the middle, 1 there, with a
    standard deviation of spread_px.
    """
    steps = np.arange(-reach_px, reach_px + 1)
    return np.asarray(np.exp(-0.5 * (steps[:, None] ** 2 + steps**2) / spread_px**2))


VOTE_REACH_PX = 4
"""Pixels that vote lie within so many, each way."""
SPREAD_PX = 2.0
"""Standard deviation of their weights by distance."""
VOTE_NEARNESS = nearness(VOTE_REACH_PX, SPREAD_PX)
"""Those weights, (2 VOTE_REACH_PX + 1, 2 VOTE_REACH_PX + 1), the pixel itself in the middle."""
COLOR_SIGMA = 0.04
"""Standard deviation of their weights by colour (sRGB-encoded, all channels together)."""
UNLIKE_WEIGHT = 1e-3
"""Of a pixel that looks like another thing altogether: where nothing looks alike, the nearest decide."""
VOTE_BINS = 24
"""The range of the disparities around a pixel is cut into so many; the vote is for one of them and its neighbours."""
SIDE_BINS = 0.7
"""How much the neighbours of a bin count for it."""
MOST_VOTE_ROUNDS = 64
"""Pixels farther than this from all that is known are filled from the background side."""
MOST_PIECE_PIXELS = 1 << 12


def fill_disparity_by_color(photo: FloatImage, values: FloatImage) -> FloatImage:
    """Replace the NaN of a disparity map (H, W) by the photo (H, W, 3), sRGB-encoded; known values stay as they are.

    From what is known inwards: each pixel takes the disparity for which most pixels around it vote, weighted by how
    near they are and how alike they look (a bilateral mode filter); what was filled votes in the next round. All
    results lie within the known values. Raises ValueError if the sizes differ or nothing is known.
    """
    if photo.shape != (*values.shape, 3):
        raise ValueError(f"the photo is {photo.shape}, the disparity {values.shape}")
    filled = np.array(values, np.float32, order="C")
    colors, queued = np.ascontiguousarray(photo, np.float32), np.zeros(filled.shape, np.bool_)
    unknown = np.flatnonzero(np.isnan(filled))
    if len(unknown) == filled.size:
        raise ValueError("no known value to fill from")
    pixels = _beside_known(filled, unknown, queued)
    for _ in range(MOST_VOTE_ROUNDS):
        if not len(pixels):
            return filled
        parts = [pixels[part] for part in pieces_of(len(pixels), MOST_PIECE_PIXELS)]
        votes = in_pieces(lambda part: _vote(colors, filled, part), parts, tiling.THREADS)
        filled.reshape(-1)[pixels] = np.concatenate(votes)
        pixels = _unknown_around(filled, pixels, queued)
    return fill_disparity_holes(filled)


@kernel
def _beside_known(values, unknown, queued):
    """Those of the unknown pixels (flat indices) that touch a known one; they are marked as queued."""
    height, width = values.shape
    found, count = np.empty(len(unknown), np.int64), 0
    for n in range(len(unknown)):
        y, x = unknown[n] // width, unknown[n] % width
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                # NaN differs from itself.
                queued[y, x] |= values[v, u] == values[v, u]
        if queued[y, x]:
            found[count] = unknown[n]
            count += 1
    return found[:count]


@kernel
def _unknown_around(values, pixels, queued):
    """The unknown pixels (flat indices) that touch these and are not queued yet; now they are."""
    height, width = values.shape
    found, count = np.empty(8 * len(pixels), np.int64), 0
    for pixel in pixels:
        y, x = pixel // width, pixel % width
        for v in range(max(y - 1, 0), min(y + 2, height)):
            for u in range(max(x - 1, 0), min(x + 2, width)):
                if values[v, u] != values[v, u] and not queued[v, u]:
                    queued[v, u] = True
                    found[count] = v * width + u
                    count += 1
    return found[:count]


@kernel
def _vote(colors, values, pixels):
    """The disparities (N) that pixels (flat indices) get from what is known around them; each has something there."""
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
                if d == d:
                    low, high = min(low, d), max(high, d)
        # A histogram of votes; all in one bin where there is one disparity only.
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
                # Colours that are not finite are like no other.
                likeness = exp(-0.5 * apart / (COLOR_SIGMA * COLOR_SIGMA)) if apart < np.inf else 0.0
                w = (likeness + UNLIKE_WEIGHT) * VOTE_NEARNESS[v - y + VOTE_REACH_PX, u - x + VOTE_REACH_PX]
                weight[v - top, u - left] = w
                bins[int((d - low) * scale)] += w
        # Its mode: a surface that crosses the border of two bins keeps its votes together.
        elected, most = 0, -1.0
        for k in range(VOTE_BINS):
            votes = bins[k] + SIDE_BINS * (
                bins[max(k - 1, 0)] * (k > 0) + bins[min(k + 1, VOTE_BINS - 1)] * (k < VOTE_BINS - 1)
            )
            if votes > most:
                elected, most = k, votes
        # The mean of those who voted for it.
        total = weights = 0.0
        for v in range(top, bottom):
            for u in range(left, right):
                d = np.float64(values[v, u])
                if d == d and abs(int((d - low) * scale) - elected) <= 1:
                    w = weight[v - top, u - left]
                    total, weights = total + w * (d - low), weights + w
        result[n] = min(low + total / weights, high)
    return result
