"""A plain warp: the nearest surface that lands on each pixel, its colour by OpenCV's bicubic look-up, holes filled from
the nearest background. The steps of `iibr_core.evaluation.reference_warp`, whose Lanczos kernel takes most of its time.
"""

from __future__ import annotations

from collections.abc import Callable

import cv2
import numpy as np

from iibr_core.evaluation.reference_warp import NOWHERE, _splat, fill_holes
from iibr_core.types import FloatImage, ViewOffset, image_size


def prepare(photo: FloatImage, disparity: FloatImage) -> Callable[[ViewOffset], FloatImage]:
    """Makes views (H, W, 3) of a photo (H, W, 3) and its map (H, W)."""
    colors, known = np.ascontiguousarray(photo, np.float32), np.ascontiguousarray(disparity, np.float32)
    height, width = size = image_size(known)
    y, x = np.mgrid[0:height, 0:width].astype(np.float32)

    def view(at: ViewOffset) -> FloatImage:
        matrix = np.eye(4)
        matrix[:2, 3] = -at.s, -at.t
        nearest = _splat(known, matrix, *size)
        hole = nearest == NOWHERE
        nearest[hole] = 0
        from_x, from_y = x + nearest * np.float32(at.s), y + nearest * np.float32(at.t)
        hole |= (from_x < -0.5) | (from_y < -0.5) | (from_x > width - 0.5) | (from_y > height - 0.5)
        looked_up = cv2.remap(colors, from_x, from_y, cv2.INTER_CUBIC, borderMode=cv2.BORDER_REPLICATE)
        return np.asarray(fill_holes(np.clip(looked_up, 0, 1), hole, nearest), np.float32)

    return view
