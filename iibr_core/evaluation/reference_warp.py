"""The reference warp: the plain way to make a view, slow and easy to follow, that every quality has to beat.

Three steps: the nearest surface that lands on each pixel; the photo's colour where that surface lies; the colour of
the nearest background where nothing landed. It shares no code with the renderer, so that it can judge it, and gives
the masks of what the photo sees.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import binary_dilation

from iibr_core.runtime.kernels import kernel
from iibr_core.types import (
    FloatImage,
    ImageSize,
    ViewOffset,
    image_size,
)

SAMPLES = 3
"""Every pixel lands as SAMPLES x SAMPLES points, so that stretched surfaces stay closed."""
SAME_SURFACE = 0.08
"""Pixels whose disparities (px per view step) differ by less are one surface, interpolated between them."""
LOBES = 3
"""Of the Lanczos kernel."""
NOWHERE = -1e30
LONGEST_PX = 120
SIMILAR = 0.15
"""What is seen around a hole within this disparity of the farthest fills it."""
EIGHT = np.array([(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, 1), (1, -1), (-1, -1)])


@dataclass(frozen=True, eq=False)
class WarpedView:
    """colors: (H, W, 3). disparity: (H, W), in holes meaningless. hole: (H, W), True where the photo shows nothing."""

    colors: FloatImage
    disparity: FloatImage
    hole: NDArray[np.bool_]

    @property
    def visible(self) -> NDArray[np.bool_]:
        """All but the holes and one pixel around them."""
        return np.asarray(~binary_dilation(self.hole, np.ones((3, 3), bool)))


def reference_warp(photo: FloatImage, disparity: FloatImage, offset: ViewOffset) -> WarpedView:
    """The view at an offset of a photo (H, W, 3), sRGB-encoded in 0..1, with disparity (H, W), px per view step."""
    view_from_photo = np.eye(4)
    view_from_photo[:2, 3] = -offset.s, -offset.t  # x lands at x - d (s, t)
    return reference_warp_to(photo, disparity, view_from_photo, image_size(disparity))


def reference_warp_to(
    photo: FloatImage, disparity: FloatImage, target_from_photo: NDArray[np.float64], size: ImageSize
) -> WarpedView:
    """The same for a camera that stands anywhere, with pictures of a size. target_from_photo: (4, 4), from (x, y, 1, d)
    of the photo to a multiple of the same of the target.
    """
    height, width = disparity.shape
    nearest = _splat(disparity.astype(np.float32), target_from_photo, *size)
    hole = nearest == NOWHERE
    nearest[hole] = 0
    y, x = np.mgrid[0 : size.height, 0 : size.width]
    back = np.linalg.inv(target_from_photo) @ np.stack([x, y, np.ones_like(x), nearest]).reshape(4, -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        from_x, from_y = (back[:2] / back[2]).reshape(2, *size)
    # What is not finite is nowhere in the photo.
    hole |= ~((from_x >= -0.5) & (from_y >= -0.5) & (from_x <= width - 0.5) & (from_y <= height - 0.5))
    from_x, from_y = (np.where(hole, 0.0, place) for place in (from_x, from_y))
    colors = np.clip(_lanczos(photo.astype(np.float32), from_x, from_y), 0, 1)
    return WarpedView(fill_holes(colors, hole, nearest), nearest, hole)


@kernel
def _splat(disparity, matrix, target_height, target_width):
    """The nearest (largest) disparity, by the target's measure, that a 4x4 matrix lands on each pixel; else NOWHERE."""
    height, width = disparity.shape
    nearest = np.full((target_height, target_width), NOWHERE, np.float32)
    for y in range(height):
        for x in range(width):
            for j in range(SAMPLES):
                for i in range(SAMPLES):
                    point_x = x + (i + 0.5) / SAMPLES - 0.5
                    point_y = y + (j + 0.5) / SAMPLES - 0.5
                    d = _surface_at(disparity, x, y, point_x, point_y)
                    # Forward warp. A z-test keeps the nearest.
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
    """Disparity at a point of pixel (x, y): between the four around it if they are one surface, else the pixel's."""
    left, top = math.floor(point_x), math.floor(point_y)
    if left < 0 or top < 0 or left + 1 >= disparity.shape[1] or top + 1 >= disparity.shape[0]:
        return disparity[y, x]
    a, b = disparity[top, left], disparity[top, left + 1]
    c, d = disparity[top + 1, left], disparity[top + 1, left + 1]
    # Across a depth edge nothing is interpolated: such points would fly free.
    if not max(a, b, c, d) - min(a, b, c, d) < SAME_SURFACE:
        return disparity[y, x]
    across, down = np.float32(point_x - left), np.float32(point_y - top)
    return (a * (1 - across) + b * across) * (1 - down) + (c * (1 - across) + d * across) * down


@kernel
def _lanczos_weight(distance):
    if distance == 0:
        return 1.0
    if abs(distance) >= LOBES:
        return 0.0
    # sinc(x) sinc(x / LOBES).
    angle = math.pi * distance
    return LOBES * math.sin(angle) * math.sin(angle / LOBES) / (angle * angle)


@kernel
def _lanczos(photo, from_x, from_y):
    """The photo (H, W, 3) at the positions (H, W); its border is repeated."""
    height, width = photo.shape[:2]
    result = np.empty((*from_x.shape, 3), np.float32)
    weights_x, weights_y = np.empty(2 * LOBES), np.empty(2 * LOBES)
    for row in range(from_x.shape[0]):
        for column in range(from_x.shape[1]):
            x = min(max(from_x[row, column], -0.5), width - 0.5)
            y = min(max(from_y[row, column], -0.5), height - 0.5)
            # The 6 x 6 taps around the position; separable weights.
            left, top = math.floor(x) - LOBES + 1, math.floor(y) - LOBES + 1
            for k in range(2 * LOBES):
                weights_x[k], weights_y[k] = _lanczos_weight(x - left - k), _lanczos_weight(y - top - k)
            total = red = green = blue = 0.0
            for j in range(2 * LOBES):
                v = min(max(top + j, 0), height - 1)
                for i in range(2 * LOBES):
                    u = min(max(left + i, 0), width - 1)
                    w = weights_x[i] * weights_y[j]
                    total += w
                    red += w * photo[v, u, 0]
                    green += w * photo[v, u, 1]
                    blue += w * photo[v, u, 2]
            # Lanczos weights do not sum to exactly 1.
            result[row, column, 0] = red / total
            result[row, column, 1] = green / total
            result[row, column, 2] = blue / total
    return result


@kernel
def fill_holes(colors, hole, disparity):
    """Colours with holes filled: of what is met first in eight directions, the farthest surface, nearer ones more."""
    height, width = hole.shape
    filled = colors.copy()
    met = np.empty((8, 3), np.int64)
    for y in range(height):
        for x in range(width):
            if not hole[y, x]:
                continue
            # What is met first in each direction, and the farthest disparity of all that.
            count, farthest = 0, np.inf
            for k in range(8):
                step_x, step_y = EIGHT[k]
                for length in range(1, LONGEST_PX + 1):
                    u, v = x + length * step_x, y + length * step_y
                    if not (0 <= u < width and 0 <= v < height):
                        break
                    if hole[v, u]:
                        continue
                    # The pixel at the very edge is mixed with what hides the hole.
                    far_u, far_v = min(max(u + step_x, 0), width - 1), min(max(v + step_y, 0), height - 1)
                    if not hole[far_v, far_u]:
                        u, v = far_u, far_v
                    met[count, 0], met[count, 1], met[count, 2] = v, u, length
                    farthest = min(farthest, disparity[v, u])
                    count += 1
                    break
            total = red = green = blue = 0.0
            # The mean of the farthest surface, by 1 / distance^2: the background continues into the hole.
            for k in range(count):
                v, u, length = met[k]
                if disparity[v, u] >= farthest + SIMILAR:
                    continue
                w = 1.0 / length**2
                total += w
                red += w * colors[v, u, 0]
                green += w * colors[v, u, 1]
                blue += w * colors[v, u, 2]
            if total > 0:
                filled[y, x, 0], filled[y, x, 1], filled[y, x, 2] = red / total, green / total, blue / total
    return filled
