"""Forward splatting: every pixel is laid onto the four next to where it lands.

Softmax splatting (Niklaus and Liu, CVPR 2020) weighs them by the exponential of their nearness, so that what is in
front wins. Stereo converters (iw3, "forward fill") dilate the foreground of the map first, so that mixed pixels go with
it. Here gaps are filled from the background in either: the published ones leave that to a network, or to the user.
https://github.com/sniklaus/softmax-splatting https://github.com/nagadomi/nunif
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from iibr_core.evaluation.warp import fill_holes
from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage, ViewOffset

SHARPNESS = 20.0
"""Factor of the softmax's exponent, per pixel of parallax."""
LEAST_WEIGHT = 0.25
"""Weight of a pixel below which it is a gap."""
DILATED_PX = 2
"""Foregrounds grow by so much, either way: iw3's usual edge dilation."""


def prepare(photo: FloatImage, disparity: FloatImage) -> Callable[[ViewOffset], FloatImage]:
    """Return a function that makes views (H, W, 3) of an sRGB-encoded photo and its disparity (px per view step)."""
    colors, surface = np.ascontiguousarray(photo, np.float32), np.ascontiguousarray(disparity, np.float32)

    def view(at: ViewOffset) -> FloatImage:
        front = np.full(surface.shape, -np.inf, np.float32)
        made, weight, depth = np.zeros_like(colors), np.zeros_like(surface), np.zeros_like(surface)
        _splat(colors, surface, float(at.t), float(at.s), front, made, weight, depth)
        return fill_holes(made, weight < LEAST_WEIGHT, depth)

    return view


def prepare_dilated(photo: FloatImage, disparity: FloatImage) -> Callable[[ViewOffset], FloatImage]:
    """The same with the foreground dilated."""
    side = 2 * DILATED_PX + 1
    return prepare(photo, np.asarray(cv2.dilate(disparity, np.ones((side, side), np.uint8)), np.float32))


@kernel
def _splat(colors, surface, t, s, front, made, weight, depth):
    height, width = surface.shape
    parallax = max(abs(t), abs(s))
    # First what is most in front anywhere, so that exponentials stay small.
    for y in range(height):
        for x in range(width):
            d = surface[y, x]
            v, u = int(np.floor(y - d * t)), int(np.floor(x - d * s))
            for j in range(max(v, 0), min(v + 2, height)):
                for i in range(max(u, 0), min(u + 2, width)):
                    front[j, i] = max(front[j, i], d)
    solid = np.zeros(surface.shape, np.float32)
    for y in range(height):
        for x in range(width):
            d = surface[y, x]
            row, column = y - d * t, x - d * s
            v, u = int(np.floor(row)), int(np.floor(column))
            for j in range(max(v, 0), min(v + 2, height)):
                for i in range(max(u, 0), min(u + 2, width)):
                    area = (1 - abs(row - j)) * (1 - abs(column - i))
                    w = area * np.exp(SHARPNESS * parallax * (d - front[j, i]))
                    solid[j, i] += w
                    weight[j, i] += area
                    depth[j, i] += w * d
                    for c in range(3):
                        made[j, i, c] += w * colors[y, x, c]
    for y in range(height):
        for x in range(width):
            whole = max(solid[y, x], np.float32(1e-6))
            depth[y, x] /= whole
            for c in range(3):
                made[y, x, c] /= whole
