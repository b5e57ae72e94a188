"""The guided filter (He, Sun and Tang, ECCV 2010): means that stop at the edges of a picture, at a cost that does not
grow with their radius.
"""

from __future__ import annotations

import numpy as np

from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage


class GuidedFilter:
    """Filters images (H, W) along the edges of a guide (H, W), all float32 and finite.

    radius: px of the windows, each way. smoothness: variance of the guide below which a window counts as flat.
    One thread may use it at a time: what it needs between steps is kept.
    """

    def __init__(self, guide: FloatImage, radius: int, smoothness: float) -> None:
        self._guide = np.ascontiguousarray(guide, np.float32)
        self._radius = radius
        self._spare = tuple(np.empty_like(self._guide) for _ in range(4))
        self._mean, variance = np.empty_like(self._guide), np.empty_like(self._guide)
        _box_mean(self._guide, radius, self._mean, self._spare[3])
        _box_mean(self._guide * self._guide, radius, variance, self._spare[3])
        self._steadied = np.maximum(variance - self._mean * self._mean, 0) + np.float32(smoothness)

    def apply(self, image: FloatImage) -> None:
        """Replace an image (H, W) by its filtered self."""
        _filter(image, self._guide, self._mean, self._steadied, self._radius, *self._spare)

    def twin(self) -> GuidedFilter:
        """Another one of the same guide, for another thread."""
        twin = object.__new__(GuidedFilter)
        twin.__dict__.update(self.__dict__)
        twin._spare = tuple(np.empty_like(self._guide) for _ in range(4))
        return twin


@kernel
def _box_mean(image, radius, out, spare):
    """Means over squares of 2 radius + 1, cut at the borders, by running sums: of columns into spare, then of rows."""
    height, width = image.shape
    for y in range(height):
        # float64: what a running sum of float32 forgot would stay in it to the end of the row.
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
            out[y, x] = totals[x] / count


@kernel
def _filter(image, guide, guide_mean, guide_steadied, radius, first, second, third, spare):
    """Make the image mean(a) guide + mean(b), where a and b fit it to the guide in each window (equations 5, 6, 8)."""
    height, width = image.shape
    _box_mean(image, radius, first, spare)
    for y in range(height):
        for x in range(width):
            second[y, x] = image[y, x] * guide[y, x]
    _box_mean(second, radius, third, spare)
    for y in range(height):
        for x in range(width):
            slope = (third[y, x] - first[y, x] * guide_mean[y, x]) / guide_steadied[y, x]
            second[y, x] = slope
            first[y, x] -= slope * guide_mean[y, x]
    _box_mean(second, radius, third, spare)
    _box_mean(first, radius, second, spare)
    for y in range(height):
        for x in range(width):
            image[y, x] = third[y, x] * guide[y, x] + second[y, x]
