"""Decides whether two pictures show one scene, as a stereo pair does. Their exposures may differ."""

import itertools
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

WIDTH_PX, MAX_HEIGHT_PX = 96, 192
"""Size at which pictures are compared."""
BLOCK_PX = 11
"""Side of the square around a pixel that is searched in the other picture."""
MAX_SHIFT_PX, MAX_RISE_PX = 14, 1
"""Largest distance of the search, across and up or down: 15 % and 1 % of the width."""
MIN_CORRELATION = 0.8
"""Normalised correlation from which a square counts as found."""
MIN_FOUND_SHARE = 0.6
"""Share of the squares with texture that a pair finds. Measured: at least 0.78 for 39 pairs, and at most 0.46 for 240
halves and neighbours of other pictures, coins in rows beside their mirror image aside.
"""
MIN_VARIANCE, NOISE_VARIANCE = 27.0, 12.0
"""Variance of a square with texture, and what noise adds, as sums over red, green and blue of 0..255."""
MIN_TEXTURED = 20
"""Fewest squares with texture that allow a decision."""
MAX_PLAIN_DIFFERENCE = 12.0
"""Largest mean difference of two pictures without texture, of values 0..255."""


def is_one_scene(first: NDArray[np.uint8], second: NDArray[np.uint8]) -> bool:
    """Return whether two pictures (h, w, 3) of at least one pixel show one scene from two places side by side."""
    a, b = _colors(first, first.shape), _colors(second, first.shape)
    mean_a, variance_a = _mean_and_variance(a)
    is_textured = np.maximum(variance_a, _mean_and_variance(b)[1]) > MIN_VARIANCE
    if is_textured.sum() < MIN_TEXTURED:
        return bool(np.abs(a - b).mean() <= MAX_PLAIN_DIFFERENCE)
    best = np.full(variance_a.shape, -1.0)
    padded = np.pad(b, ((MAX_RISE_PX, MAX_RISE_PX), (MAX_SHIFT_PX, MAX_SHIFT_PX), (0, 0)), "edge")
    for rise, shift in itertools.product(range(2 * MAX_RISE_PX + 1), range(2 * MAX_SHIFT_PX + 1)):
        moved = padded[rise : rise + a.shape[0], shift : shift + a.shape[1]]
        mean_b, variance_b = _mean_and_variance(moved)
        covariance = _block_mean((a * moved).sum(axis=2)) - (mean_a * mean_b).sum(axis=2)
        np.maximum(best, covariance / np.sqrt((variance_a + NOISE_VARIANCE) * (variance_b + NOISE_VARIANCE)), out=best)
    return bool((best[is_textured] >= MIN_CORRELATION).mean() >= MIN_FOUND_SHARE)


def _colors(pixels: NDArray[np.uint8], shape: tuple[int, ...]) -> NDArray[np.float64]:
    height = min(max(round(shape[0] * WIDTH_PX / shape[1]), BLOCK_PX), MAX_HEIGHT_PX)
    picture = Image.fromarray(pixels).resize((WIDTH_PX, height), Image.Resampling.BOX)
    return np.asarray(picture, np.float64)


def _mean_and_variance(colors: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the mean of each square (h, w, 3), and its variance, summed over the channels (h, w)."""
    mean = _block_mean(colors)
    return mean, np.maximum(_block_mean((colors**2).sum(axis=2)) - (mean**2).sum(axis=2), 0)


def _block_mean(values: NDArray[Any]) -> NDArray[np.float64]:
    """Return the mean of each whole square of BLOCK_PX within `values`, along the first two axes."""
    sums = np.pad(values, ((1, 0), (1, 0), *((0, 0),) * (values.ndim - 2))).cumsum(axis=0).cumsum(axis=1)
    n = BLOCK_PX
    return np.asarray(sums[n:, n:] - sums[:-n, n:] - sums[n:, :-n] + sums[:-n, :-n]) / n**2
