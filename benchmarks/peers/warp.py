"""A plain warp: the nearest surface that lands on each pixel, its colour by OpenCV's bicubic look-up, holes filled from
the nearest background. The steps of `iibr_core.evaluation.warp`, which is written to be followed, and takes
three times as long: it looks up by a Lanczos kernel and warps to any camera.
"""

from __future__ import annotations

from collections.abc import Callable
from math import floor

import cv2
import numpy as np

from iibr_core.evaluation.warp import NOWHERE, SAME_SURFACE, SAMPLES, fill_holes
from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage, ViewOffset, image_size


def prepare(photo: FloatImage, disparity: FloatImage) -> Callable[[ViewOffset], FloatImage]:
    """Makes views (H, W, 3) of a photo (H, W, 3) and its map (H, W)."""
    colors, known = np.ascontiguousarray(photo, np.float32), np.ascontiguousarray(disparity, np.float32)
    height, width = image_size(known)
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)

    def view(at: ViewOffset) -> FloatImage:
        nearest = _land(known, float(at.t), float(at.s))
        hole = nearest == NOWHERE
        nearest[hole] = 0
        from_x, from_y = x + nearest * np.float32(at.s), y + nearest * np.float32(at.t)
        hole |= (from_x < -0.5) | (from_y < -0.5) | (from_x > width - 0.5) | (from_y > height - 0.5)
        looked_up = cv2.remap(colors, from_x, from_y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(fill_holes(np.clip(looked_up, 0, 1), hole, nearest), np.float32)

    return view


@kernel
def _land(disparity, t, s):
    """The nearest (largest) disparity that lands on each pixel of the view at (t, s); else NOWHERE."""
    height, width = disparity.shape
    nearest = np.full((height, width), NOWHERE, np.float32)
    for y in range(height):
        for x in range(width):
            for j in range(SAMPLES):
                for i in range(SAMPLES):
                    point_x, point_y = x + (i + 0.5) / SAMPLES - 0.5, y + (j + 0.5) / SAMPLES - 0.5
                    left, top, value = floor(point_x), floor(point_y), disparity[y, x]
                    if 0 <= left < width - 1 and 0 <= top < height - 1:
                        a, b = disparity[top, left], disparity[top, left + 1]
                        c, d = disparity[top + 1, left], disparity[top + 1, left + 1]
                        # Within one surface, between the four around the point.
                        if max(max(a, b), max(c, d)) - min(min(a, b), min(c, d)) < SAME_SURFACE:
                            across, down = point_x - left, point_y - top
                            value = (a * (1 - across) + b * across) * (1 - down) + (
                                c * (1 - across) + d * across
                            ) * down
                    u, v = floor(point_x - value * s + 0.5), floor(point_y - value * t + 0.5)
                    if 0 <= u < width and 0 <= v < height and value > nearest[v, u]:
                        nearest[v, u] = value
    return nearest
