"""Planes with soft alpha, as multiplane images have them (Tucker and Snavely, CVPR 2020), but made of a given map.

Each pixel is shared by the two planes next to its disparity. Behind what they show, planes go on as far as gaps open,
with colours from the background; a view lays them over one another from back to front, each moved as a whole, bilinear.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from iibr_core.evaluation.warp import fill_holes
from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage, ViewOffset

PLANES = 32
BEHIND_PX = 24
"""Distance over which planes continue behind nearer ones."""


def prepare(photo: FloatImage, disparity: FloatImage) -> Callable[[ViewOffset], FloatImage]:
    """Return a function that makes views (H, W, 3) of an sRGB-encoded photo and its disparity (px per view step)."""
    far, near = float(disparity.min()), float(disparity.max())
    levels = np.linspace(far, near, PLANES).astype(np.float32)
    place = (disparity - far) * ((PLANES - 1) / max(near - far, 1e-9))
    planes = np.zeros((PLANES, *disparity.shape, 4), np.float32)
    for k in range(PLANES):
        share = np.clip(1 - np.abs(place - k), 0, 1)
        # All of it where a nearer plane shares it: what is laid over it then adds up to the pixel.
        planes[k, ..., 3] = np.where(place > k, (share > 0).astype(np.float32), share)
        planes[k, ..., :3] = photo
    _go_on(planes, place.astype(np.float32))

    def view(at: ViewOffset) -> FloatImage:
        made, alpha = np.zeros(photo.shape, np.float32), np.zeros(disparity.shape, np.float32)
        _lay_over(planes, levels, float(at.t), float(at.s), made, alpha)
        return fill_holes(made / np.maximum(alpha, 1e-6)[..., None], alpha < 0.5, np.zeros_like(alpha))

    return view


@kernel
def _go_on(planes, place):
    """Into what lies in front of them, planes continue row by row, as they were last seen, so far and no farther."""
    _, height, width, _ = planes.shape
    for y in range(height):
        for way in (1, -1):
            begin, end = (0, width) if way == 1 else (width - 1, -1)
            last = begin
            for x in range(begin, end, way):
                here, before = place[y, x], place[y, last]
                if here - before > 2.0 and abs(x - last) <= BEHIND_PX:
                    k = int(before)
                    if planes[k, y, x, 3] == 0:
                        for c in range(3):
                            planes[k, y, x, c] = planes[k, y, last, c]
                        planes[k, y, x, 3] = 1.0
                else:
                    last = x


@kernel
def _lay_over(planes, levels, t, s, made, alpha):
    height, width = alpha.shape
    for k in range(len(levels)):
        down, across = levels[k] * t, levels[k] * s
        for y in range(height):
            row = y + down
            v = int(np.floor(row))
            if v < 0 or v + 1 >= height:
                continue
            fy = np.float32(row - v)
            for x in range(width):
                column = x + across
                u = int(np.floor(column))
                if u < 0 or u + 1 >= width:
                    continue
                fx = np.float32(column - u)
                a, b = (1 - fy) * (1 - fx) * planes[k, v, u, 3], (1 - fy) * fx * planes[k, v, u + 1, 3]
                c, d = fy * (1 - fx) * planes[k, v + 1, u, 3], fy * fx * planes[k, v + 1, u + 1, 3]
                own = a + b + c + d
                if own > 0:
                    for i in range(3):
                        color = a * planes[k, v, u, i] + b * planes[k, v, u + 1, i]
                        color += c * planes[k, v + 1, u, i] + d * planes[k, v + 1, u + 1, i]
                        made[y, x, i] = color + (1 - own) * made[y, x, i]
                    alpha[y, x] = own + (1 - own) * alpha[y, x]
