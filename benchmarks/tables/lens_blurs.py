"""What a lens does to a photo with a disparity map, the plain ways: one photo in, nothing made up behind its surfaces.

Both take linear light (H, W, 3), finite disparity (H, W), px per view step, and a lens; both give linear light
(H, W, 3). A pixel's circle of confusion has a radius of |disparity - focus| times the aperture's, px.
"""

from __future__ import annotations

from math import sqrt

import numpy as np

from benchmarks.thin_lens import ThinLens
from iibr_core.runtime.jit import kernel
from iibr_core.types import FloatImage


def scatter(linear: FloatImage, disparity: FloatImage, lens: ThinLens) -> FloatImage:
    """Every pixel's light spread over its circle; layer over layer, back to front.

    Within a layer circles differ by one pixel at most and add up: pixels side by side do not hide each other.
    """
    radius = circle_radius(disparity, lens)
    layers = np.floor((disparity - disparity.min()) * lens.radius_views).astype(np.int64)
    total = np.zeros((*disparity.shape, 4), np.float32)
    for layer in np.unique(layers):
        spread = np.zeros_like(total)
        _spread(linear, radius, layers == layer, spread)
        total = spread / np.maximum(spread[..., 3:], 1) + total * np.maximum(1 - spread[..., 3:], 0)
    return np.asarray(total[..., :3] / total[..., 3:], np.float32)


def gather(linear: FloatImage, disparity: FloatImage, lens: ThinLens) -> FloatImage:
    """Every pixel the mean of those within its own circle whose circles reach it."""
    total = np.zeros((*disparity.shape, 4), np.float32)
    _gather(linear, circle_radius(disparity, lens), total)
    return np.asarray(total[..., :3] / total[..., 3:], np.float32)


def circle_radius(disparity: FloatImage, lens: ThinLens) -> FloatImage:
    """(H, W), px."""
    return np.asarray(np.abs(disparity - lens.focus_disparity) * lens.radius_views, np.float32)


@kernel
def _share(radius, dy, dx):
    """How much of a pixel that far from its middle lies in a circle, about; the middle one does."""
    return 1.0 if dy == 0 and dx == 0 else min(max(radius + 0.5 - sqrt(dy * dy + dx * dx), 0.0), 1.0)


@kernel
def _spread(linear, radius, chosen, total):
    """Add to `total` (H, W, 4) colours and coverage of the chosen pixels, (H, W) bool, each spread over its circle."""
    height, width = radius.shape
    for y in range(height):
        for x in range(width):
            if not chosen[y, x]:
                continue
            r = radius[y, x]
            reach = int(r + 0.5)
            area = 0.0
            for dy in range(-reach, reach + 1):
                for dx in range(-reach, reach + 1):
                    area += _share(r, dy, dx)
            for v in range(max(y - reach, 0), min(y + reach + 1, height)):
                for u in range(max(x - reach, 0), min(x + reach + 1, width)):
                    share = _share(r, v - y, u - x) / area
                    for c in range(3):
                        total[v, u, c] += share * linear[y, x, c]
                    total[v, u, 3] += share


@kernel
def _gather(linear, radius, total):
    """Colours and weights, (H, W, 4), of what each pixel sees."""
    height, width = radius.shape
    for y in range(height):
        for x in range(width):
            reach = int(radius[y, x] + 0.5)
            for v in range(max(y - reach, 0), min(y + reach + 1, height)):
                for u in range(max(x - reach, 0), min(x + reach + 1, width)):
                    share = _share(min(radius[y, x], radius[v, u]), v - y, u - x)
                    for c in range(3):
                        total[y, x, c] += share * linear[v, u, c]
                    total[y, x, 3] += share
