"""Evidence from the photo: which end of a map is near, whether the map is turned, whether its zeros are depth.

Files say this by conventions that contradict each other. A guess from the photo alone orders nearly all scenes rightly
as a whole, however wrong it is in detail, and edges of depth lie on edges of the photo.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.guess import box_filter, guess_depth, resize_picture, size_within
from iibr_core.types import FloatImage, ImageSize, Photo, image_size

COMPARED_PX = 160
"""Photo and map are compared at this size."""
SURE_CORRELATION = 0.25
"""Rank correlation of map and guess from which the photo decides: 0.44 was the least of 20 scenes with known depth."""
LEAST_ALIGNED = 0.1
"""By so much more have edges to correlate before a map counts as turned like the stored photo."""
SMALLEST_ZERO_GAP = 0.03
"""Zeros continue a map's values where the next ones lie nearer than this share of their range."""
OPENING_SHARE = 0.02
"""Radius in widths: what an opening by it leaves of the zeros is a large area."""
LARGE_ZEROS, MOST_OF_ZEROS = 0.03, 0.5
"""Large areas of zeros cover these shares of the picture, and of all zeros."""


def near_evidence(photo: FloatImage, values: FloatImage) -> float:
    """How far the photo (H, W, 3), sRGB-encoded, says that larger values of its map (h, w) are nearer.

    Above 0: they look nearer; below: they look farther; beyond 1 and -1 it is sure. 0 where nothing can be said. Values
    that are not finite are left out.
    """
    if not (photo.size and values.size):
        return 0.0
    size = size_within(image_size(photo), COMPARED_PX)
    small = resize_picture(np.clip(np.nan_to_num(photo), 0, 1), size)
    guess = guess_depth(Photo(small, float(size.width), "")).values
    own = _sampled(values, size)
    known = np.isfinite(own)
    if known.sum() < 3:
        return 0.0
    ranks, guessed = _ranks(own[known]), _ranks(guess[known])
    spread = float(ranks.std() * guessed.std())
    if spread <= 0:
        return 0.0
    correlation = float(((ranks - ranks.mean()) * (guessed - guessed.mean())).mean()) / spread
    return correlation / SURE_CORRELATION


def is_better_turned(photo: FloatImage, values: FloatImage, turned: FloatImage) -> bool:
    """Whether the edges of a map lie on those of the photo (H, W, 3) once it is turned, and not as it is."""
    return _alignment(photo, turned) > _alignment(photo, values) + LEAST_ALIGNED


def zeros_are_depth(values: FloatImage, is_zero: NDArray[np.bool_]) -> bool:
    """Whether the zeros of a map of integers (h, w) are its farthest or nearest depth; else nothing is known there.

    They are depth where the other values go on to nearly 0, and where most of them form large areas, as sky does:
    what sensors and matching leave out is scattered, or lies along edges. values: as stored.
    """
    others = values[~is_zero & np.isfinite(values)]
    if not others.size:
        return False
    low, high = np.percentile(others, (0.5, 99.5))
    if low <= SMALLEST_ZERO_GAP * high:
        return True
    radius = max(1, round(OPENING_SHARE * is_zero.shape[1]))
    inner = box_filter(is_zero.astype(np.float32), radius) > 1 - 1e-4
    areas = is_zero & (box_filter(inner.astype(np.float32), radius) > 1e-6)
    return bool(areas.mean() >= LARGE_ZEROS and areas.sum() >= MOST_OF_ZEROS * is_zero.sum())


def _sampled(values: FloatImage, size: ImageSize) -> FloatImage:
    """The map's values nearest to the pixels of a picture of this size."""
    rows, columns = (((np.arange(count) + 0.5) * own / count).astype(int) for count, own in zip(size, values.shape))
    return np.asarray(values[rows[:, None], columns])


def _ranks(values: FloatImage) -> NDArray[np.float64]:
    """Ranks of values (N,), equal ones sharing the middle of theirs."""
    ordered = np.sort(values)
    below, upto = np.searchsorted(ordered, values, "left"), np.searchsorted(ordered, values, "right")
    return np.asarray((below + upto) / 2)


def _alignment(photo: FloatImage, values: FloatImage) -> float:
    """Correlation of the strengths of edges of photo and map."""
    if not (photo.size and values.size):
        return 0.0
    size = size_within(image_size(photo), COMPARED_PX)
    small = resize_picture(np.clip(np.nan_to_num(photo), 0, 1), size)
    own = _sampled(values, size)
    own = np.where(np.isfinite(own), own, np.nanmedian(own) if np.isfinite(own).any() else 0)
    pictured, mapped = (box_filter(_edge_strength(image), 1).ravel() for image in (small, own[..., None]))
    spread = float(pictured.std() * mapped.std())
    return float(((pictured - pictured.mean()) * (mapped - mapped.mean())).mean()) / spread if spread > 0 else 0.0


def _edge_strength(image: FloatImage) -> FloatImage:
    """(H, W): how much an image (H, W, C) without its finest texture changes from pixel to pixel, up to a limit."""
    smooth = box_filter(box_filter(image, 1), 1)
    down, across = (np.diff(smooth, axis=axis, append=smooth.take([-1], axis)) for axis in (0, 1))
    strength = np.sqrt((down**2 + across**2).sum(axis=2))
    limit = float(np.percentile(strength, 95))
    return np.asarray(np.minimum(strength, limit) if limit > 0 else strength, np.float32)
