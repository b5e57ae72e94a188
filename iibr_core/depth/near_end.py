"""Evidence from the photo on its map: which end is near, and which way up the map lies.

Photo and map are compared at a small size. The picture's cues (`guess`) order pixels by depth.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.guess import box_filter, guess_depth, resize_picture, size_within
from iibr_core.formats.maps.resample import nearest_pixels
from iibr_core.types import FloatImage, Photo, image_size

COMPARED_PX = 160
"""Longer side of the compared pictures, in pixels."""
SAMPLES_ACROSS = 2
"""Number of pixels of the photo, at least, along each side of an area that a compared pixel is the mean of."""
SURE_CORRELATION = 0.25
"""Rank correlation of map and guess from which the photo decides: 0.44 was the least of 20 scenes with known depth."""
TURNED_MARGIN = 0.1
"""Gain in the correlation of edges from which a map counts as turned."""


def near_evidence(photo: FloatImage, values: FloatImage) -> float:
    """Return how clearly the photo (H, W, 3), sRGB-encoded, shows that larger values of its map (h, w) are nearer.

    Above 0 they look nearer, below 0 farther; beyond 1 and -1 the answer is certain. Unknown values are left out.
    """
    small, sampled = _at_compared_size(photo, values)
    guess = guess_depth(Photo(small, float(small.shape[1]), "")).values
    known = np.isfinite(sampled)
    return _correlation(_ranks(sampled[known]), _ranks(guess[known])) / SURE_CORRELATION


def is_better_turned(photo: FloatImage, values: FloatImage, turned: FloatImage) -> bool:
    """Return whether the edges of a map fit those of the photo (H, W, 3) clearly better once the map is turned."""
    return _edge_correlation(photo, turned) > _edge_correlation(photo, values) + TURNED_MARGIN


def _at_compared_size(photo: FloatImage, values: FloatImage) -> tuple[FloatImage, FloatImage]:
    """Return the photo made small, and the nearest values of the map."""
    size = size_within(image_size(photo), COMPARED_PX)
    # Some pixels of each area are enough for its mean: large photos would take a second.
    step = max(min(photo.shape[:2]) // (SAMPLES_ACROSS * min(size)), 1)
    sampled = np.clip(np.nan_to_num(photo[::step, ::step]), 0, 1)
    return resize_picture(sampled, size), nearest_pixels(values, size)


def _ranks(values: FloatImage) -> NDArray[np.float64]:
    """Return the ranks of values (N,); equal values share the middle of theirs."""
    _, places, counts = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(counts) - counts / 2)[places])


def _correlation(first: NDArray[np.float64], second: NDArray[np.float64]) -> float:
    """Return the correlation of values (N,); 0 if either is constant."""
    if not first.size or not first.std() * second.std():
        return 0.0
    return float(np.corrcoef(first, second)[0, 1])


def _edge_correlation(photo: FloatImage, values: FloatImage) -> float:
    """Return the correlation of the edge strengths of photo and map."""
    small, sampled = _at_compared_size(photo, values)
    known = np.isfinite(sampled)
    sampled = np.where(known, sampled, np.median(sampled[known]) if known.any() else 0)
    first, second = (box_filter(_edge_strength(image), 1).ravel() for image in (small, sampled[..., None]))
    return _correlation(first.astype(np.float64), second.astype(np.float64))


def _edge_strength(image: FloatImage) -> FloatImage:
    """Return the change from pixel to pixel (H, W) of an image (H, W, C) without its finest texture, up to a limit."""
    smooth = box_filter(box_filter(image, 1), 1)
    down, across = (np.diff(smooth, axis=axis, append=smooth.take([-1], axis)) for axis in (0, 1))
    strength = np.sqrt((down**2 + across**2).sum(axis=2))
    limit = float(np.percentile(strength, 95))
    return np.asarray(np.minimum(strength, limit) if limit > 0 else strength, np.float32)
