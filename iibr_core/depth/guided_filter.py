"""The guided filter (He, Sun and Tang, ECCV 2010): means that stop at the edges of a picture.

Its cost does not depend on the radius.
"""

from __future__ import annotations

import numpy as np

from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage


class GuidedFilter:
    """Filters images along the edges of a guide (H, W), all float32 and finite, in any thread.

    radius: of the square windows, in pixels. smoothness: variance of the guide below which a window counts as flat.
    """

    def __init__(self, guide: FloatImage, radius: int, smoothness: float) -> None:
        self._guide, self._radius = np.ascontiguousarray(guide, np.float32), radius
        self._mean, square, spare = (np.empty_like(self._guide) for _ in range(3))
        _box_mean(self._guide, radius, self._mean, spare)
        _box_mean(self._guide * self._guide, radius, square, spare)
        self._variance = np.maximum(square - self._mean * self._mean, 0) + np.float32(smoothness)

    def apply(self, images: FloatImage) -> None:
        """Replace images (N, H, W) by their filtered versions."""
        _filter(images, self._guide, self._mean, self._variance, self._radius)


@kernel
def _box_mean(image, radius, result, spare):
    """Fill result with means over squares of 2 radius + 1 pixels, cut at the borders, by running sums."""
    height, width = image.shape
    for y in range(height):
        # float64: a rounding error of a running sum stays in it to the end of the row.
        total, count = 0.0, min(radius, width)
        for x in range(count):
            total += image[y, x]
        for x in range(width):
            if x + radius < width:
                total += image[y, x + radius]
                count += 1
            if x - radius - 1 >= 0:
                total -= image[y, x - radius - 1]
                count -= 1
            spare[y, x] = total / count
    totals = np.zeros(width, np.float64)
    count = min(radius, height)
    for y in range(count):
        for x in range(width):
            totals[x] += spare[y, x]
    for y in range(height):
        if y + radius < height:
            count += 1
            for x in range(width):
                totals[x] += spare[y + radius, x]
        if y - radius - 1 >= 0:
            count -= 1
            for x in range(width):
                totals[x] -= spare[y - radius - 1, x]
        for x in range(width):
            result[y, x] = totals[x] / count


@kernel
def _filter(images, guide, guide_mean, guide_variance, radius):
    """Make each image mean(slope) guide + mean(base), which fit it to the guide in each window (equations 5, 6, 8)."""
    height, width = guide.shape
    mean, product = np.empty((height, width), np.float32), np.empty((height, width), np.float32)
    slope, spare = np.empty((height, width), np.float32), np.empty((height, width), np.float32)
    for image in images:
        _box_mean(image, radius, mean, spare)
        for y in range(height):
            for x in range(width):
                slope[y, x] = image[y, x] * guide[y, x]
        _box_mean(slope, radius, product, spare)
        for y in range(height):
            for x in range(width):
                gain = (product[y, x] - mean[y, x] * guide_mean[y, x]) / guide_variance[y, x]
                slope[y, x] = gain
                mean[y, x] -= gain * guide_mean[y, x]  # now the base
        _box_mean(slope, radius, product, spare)
        _box_mean(mean, radius, slope, spare)
        for y in range(height):
            for x in range(width):
                image[y, x] = product[y, x] * guide[y, x] + slope[y, x]
