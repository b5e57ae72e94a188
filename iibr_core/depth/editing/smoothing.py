"""Smoothing a disparity map within the contours of its photo, for the brush."""

from __future__ import annotations

from math import exp, sqrt

import numpy as np

from iibr_core.depth.editing.stroke_distance import CONTOUR_CONTRAST
from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage

NOISE_MEDIANS = 2.5
"""Differences between neighbours below so many medians of them are texture, no contour."""
MOST_NOISE = 0.03
SMOOTHING_ROUNDS = 3
PARTING_RADII = 3.0
"""A contour parts what is smoothed like going so many radii."""


def smooth_within_contours(photo: FloatImage, disparity: FloatImage, radius: float, noise: float) -> FloatImage:
    """The map (H, W), smoothed over about `radius` px, not across the photo's contours.

    The recursive filter of Gastal and Oliveira, "Domain transform for edge-aware image and video processing" (2011).
    noise: see `texture_contrast`.
    """
    parting = PARTING_RADII * radius / CONTOUR_CONTRAST
    steps = [np.ones(shape, np.float32) for shape in (disparity.shape, disparity.shape[::-1])]
    for turned, step in zip((photo, np.ascontiguousarray(photo.swapaxes(0, 1))), steps):
        _measure_steps(turned, parting, noise, step)
    values = np.array(disparity, np.float32, order="C")
    for k in range(SMOOTHING_ROUNDS):
        # Each round half as wide as the one before; their variances sum to radius^2.
        sigma = radius * sqrt(3) * 2 ** (SMOOTHING_ROUNDS - k - 1) / sqrt(4**SMOOTHING_ROUNDS - 1)
        for step in steps:
            _smooth_rows(values, step, sqrt(2) / sigma)
            values = np.ascontiguousarray(values.T)
    return values


def texture_contrast(photo: FloatImage) -> float:
    """Difference in colour between neighbours of a photo (H, W, 3) below which it is texture or noise."""
    step = max(1, photo.shape[0] * photo.shape[1] // 500_000)
    differences = [
        np.sqrt(np.square(np.diff(rows, axis=1)).sum(axis=2)).reshape(-1)
        for rows in (photo[::step], photo[:, ::step].swapaxes(0, 1))
    ]
    both = np.concatenate(differences)
    return min(NOISE_MEDIANS * float(np.median(both)), MOST_NOISE) if both.size else 0.0


@kernel
def _contour(photo, y, x, other_y, other_x, noise):
    """Difference in colour between two pixels beyond texture."""
    total = 0.0
    for c in range(3):
        total += (photo[y, x, c] - photo[other_y, other_x, c]) ** 2
    # Root of the summed squares, in sRGB-encoded values as CONTOUR_CONTRAST is.
    return max(sqrt(total) - noise, 0.0)


@kernel
def _measure_steps(photo, parting, noise, steps):
    """How far every pixel counts as being from the one at its left; steps: (H, W)."""
    for y in range(photo.shape[0]):
        for x in range(1, photo.shape[1]):
            # The domain transform: a step of one pixel, longer by what the colours differ.
            steps[y, x] = 1.0 + parting * _contour(photo, y, x, y, x - 1, noise)


@kernel
def _smooth_rows(values, steps, rate):
    """Every row of values, smoothed there and back. rate: by how much a pixel's step lets go of what was before."""
    height, width = values.shape
    kept = np.empty(width)
    for y in range(height):
        # There: a decaying mean of what lies left; across a contour (a large step) next to nothing of it is kept.
        for x in range(1, width):
            kept[x] = exp(-rate * steps[y, x])
            values[y, x] = kept[x] * values[y, x - 1] + (1.0 - kept[x]) * values[y, x]
        # And back with the same weights, so that the filter leans to no side.
        for x in range(width - 2, -1, -1):
            values[y, x] = kept[x + 1] * values[y, x + 1] + (1.0 - kept[x + 1]) * values[y, x]
