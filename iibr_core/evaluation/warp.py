"""The plain warp: a simple way to make a view that the program has to surpass.

Three steps: the nearest surface that lands on each pixel; the photo's colour at that surface; the colour of the nearest
background where nothing landed. It shares no code with the renderer, so it can judge it, and it gives the masks of the
pixels that the photo sees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation, map_coordinates

from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage, ImageSize, ViewOffset, image_size

SAMPLES = 3
"""Points across a pixel: it lands as SAMPLES x SAMPLES points, so that stretched surfaces stay closed."""
SAME_SURFACE = 0.08
"""Largest difference of disparity (px per view step) between pixels of one surface, which is interpolated."""
SIMILAR = 1.0
"""Largest difference of disparity (px per view step) from the farthest surface around a hole, which fills it."""


@dataclass(frozen=True, eq=False)
class WarpedView:
    """colors: (H, W, 3). disparity: (H, W), meaningless in holes. hole: (H, W), True where the photo shows nothing."""

    colors: FloatImage
    disparity: FloatImage
    hole: NDArray[np.bool_]

    @property
    def visible(self) -> NDArray[np.bool_]:
        """All but the holes and one pixel around them."""
        return np.asarray(~binary_dilation(self.hole, np.ones((3, 3), bool)))


def reference_warp(photo: FloatImage, disparity: FloatImage, offset: ViewOffset) -> WarpedView:
    """Return the view at an offset. photo: (H, W, 3), sRGB-encoded in 0..1. disparity: (H, W), px per view step."""
    view_from_photo = np.eye(4)
    view_from_photo[:2, 3] = -offset.s, -offset.t  # x lands at x - d (s, t)
    return reference_warp_to(photo, disparity, view_from_photo, image_size(disparity))


def reference_warp_to(
    photo: FloatImage, disparity: FloatImage, target_from_photo: NDArray[np.float64], size: ImageSize
) -> WarpedView:
    """Return the view of a camera anywhere, with pictures of a size.

    target_from_photo: (4, 4), from (x, y, 1, d) of the photo to a multiple of the same of the target.
    """
    height, width = disparity.shape
    nearest = _splat(disparity.astype(np.float32), target_from_photo, *size)
    hole = np.isneginf(nearest)
    nearest[hole] = 0
    y, x = np.indices(size)
    back = np.linalg.inv(target_from_photo) @ np.stack([x, y, np.ones_like(x), nearest]).reshape(4, -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        from_x, from_y = (back[:2] / back[2]).reshape(2, *size)
    # Places that are not finite lie outside the photo.
    hole |= ~((from_x >= -0.5) & (from_y >= -0.5) & (from_x <= width - 0.5) & (from_y <= height - 0.5))
    places = np.where(hole, 0, (from_y, from_x))
    channels = [map_coordinates(photo[..., c], places, np.float32, order=3, mode="nearest") for c in range(3)]
    return WarpedView(fill_holes(np.clip(np.stack(channels, -1), 0, 1), hole, nearest), nearest, hole)


@kernel
def _splat(disparity, matrix, target_height, target_width):
    """Return the nearest (largest) disparity that a 4x4 matrix lands on each pixel of the target, else -inf."""
    height, width = disparity.shape
    nearest = np.full((target_height, target_width), -np.inf, np.float32)
    for y in range(height):
        for x in range(width):
            for k in range(SAMPLES * SAMPLES):
                point_x = x + (k % SAMPLES + 0.5) / SAMPLES - 0.5
                point_y = y + (k // SAMPLES + 0.5) / SAMPLES - 0.5
                d = _surface_at(disparity, x, y, point_x, point_y)
                w = matrix[2, 0] * point_x + matrix[2, 1] * point_y + matrix[2, 2] + matrix[2, 3] * d
                if not w > 0:  # behind the camera
                    continue
                to_x = (matrix[0, 0] * point_x + matrix[0, 1] * point_y + matrix[0, 2] + matrix[0, 3] * d) / w + 0.5
                to_y = (matrix[1, 0] * point_x + matrix[1, 1] * point_y + matrix[1, 2] + matrix[1, 3] * d) / w + 0.5
                if 0 <= to_x < target_width and 0 <= to_y < target_height:
                    v, u = int(to_y), int(to_x)
                    to_d = matrix[3, 0] * point_x + matrix[3, 1] * point_y + matrix[3, 2] + matrix[3, 3] * d
                    nearest[v, u] = max(nearest[v, u], to_d / w)
    return nearest


@kernel
def _surface_at(disparity, x, y, point_x, point_y):
    """Return disparity at a point of pixel (x, y): interpolated if the four around it are one surface."""
    left, top = math.floor(point_x), math.floor(point_y)
    if left < 0 or top < 0 or left + 1 >= disparity.shape[1] or top + 1 >= disparity.shape[0]:
        return disparity[y, x]
    a, b = disparity[top, left], disparity[top, left + 1]
    c, d = disparity[top + 1, left], disparity[top + 1, left + 1]
    # Points interpolated across a depth edge would lie on no surface.
    if not max(a, b, c, d) - min(a, b, c, d) < SAME_SURFACE:
        return disparity[y, x]
    across, down = np.float32(point_x - left), np.float32(point_y - top)
    return (a * (1 - across) + b * across) * (1 - down) + (c * (1 - across) + d * across) * down


@kernel
def fill_holes(colors, hole, disparity):
    """Return colours with holes filled by the farthest surface of those met first in eight directions.

    Its pixels count by 1 / distance^2, so that the background continues into the hole.
    """
    height, width = hole.shape
    filled = colors.copy()
    met = np.empty((9, 3), np.int64)
    for y, x in np.argwhere(hole):
        count, farthest = 0, np.inf
        for k in range(9):
            step_y, step_x = k // 3 - 1, k % 3 - 1
            v, u, length = y + step_y, x + step_x, 1
            while k != 4 and 0 <= u < width and 0 <= v < height and hole[v, u]:
                u, v, length = u + step_x, v + step_y, length + 1
            if k == 4 or not (0 <= u < width and 0 <= v < height):
                continue
            # The pixel at the very edge is mixed with the surface that hides the hole.
            far_u, far_v = min(max(u + step_x, 0), width - 1), min(max(v + step_y, 0), height - 1)
            if not hole[far_v, far_u]:
                u, v = far_u, far_v
            met[count] = v, u, length
            farthest = min(farthest, disparity[v, u])
            count += 1
        total, mean = 0.0, np.zeros(3)
        for v, u, length in met[:count]:
            if disparity[v, u] < farthest + SIMILAR:
                total += 1.0 / length**2
                mean += colors[v, u] / length**2
        if total > 0:
            filled[y, x] = mean / total
    return filled
