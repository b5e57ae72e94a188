"""A parallax shader: each pixel's ray steps through the depth map as through a relief, as DepthFlow does.

DepthFlow (Tremeschin): a fragment shader marches from the nearest plane backwards, first in coarse steps, then in fine
ones from the last step in front of the relief, and takes the photo's colour, bilinear, where the ray meets it. The
relief has walls: what is disoccluded shows them, stretched. https://github.com/BrokenSource/DepthFlow
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from iibr_core.runtime.kernels import kernel
from iibr_core.types import FloatImage, ViewOffset

COARSE_PX = 1.0
"""Parallax of a step, in pixels."""
BISECTIONS = 4


def prepare(photo: FloatImage, disparity: FloatImage) -> Callable[[ViewOffset], FloatImage]:
    """Return a function that makes views (H, W, 3) of an sRGB-encoded photo and its disparity (px per view step)."""
    near, far = float(disparity.max()), float(disparity.min())
    colors, relief = np.ascontiguousarray(photo, np.float32), np.ascontiguousarray(disparity, np.float32)

    def view(at: ViewOffset) -> FloatImage:
        made = np.empty_like(colors)
        steps = max(int(np.ceil((near - far) * max(abs(at.t), abs(at.s)) / COARSE_PX)), 1)
        _march(colors, relief, float(at.t), float(at.s), near, far, steps, made)
        return made

    return view


@kernel
def _between(relief, y, x):
    """The relief at a place, bilinear, its border repeated; and the place, within it."""
    height, width = relief.shape
    y, x = min(max(y, 0.0), height - 1.001), min(max(x, 0.0), width - 1.001)
    v, u = int(y), int(x)
    down, across = y - v, x - u
    upper = (1 - across) * relief[v, u] + across * relief[v, u + 1]
    lower = (1 - across) * relief[v + 1, u] + across * relief[v + 1, u + 1]
    return (1 - down) * upper + down * lower, v, u, down, across


@kernel
def _march(colors, relief, t, s, near, far, steps, made):
    for y in range(relief.shape[0]):
        for x in range(relief.shape[1]):
            before, after = near, far
            for k in range(1, steps + 1):
                level = near + (far - near) * k / steps
                if _between(relief, y + level * t, x + level * s)[0] >= level:
                    after = level
                    break
                before = level
            for _ in range(BISECTIONS):
                middle = 0.5 * (before + after)
                if _between(relief, y + middle * t, x + middle * s)[0] >= middle:
                    after = middle
                else:
                    before = middle
            _, v, u, down, across = _between(relief, y + after * t, x + after * s)
            for c in range(3):
                upper = (1 - across) * colors[v, u, c] + across * colors[v, u + 1, c]
                lower = (1 - across) * colors[v + 1, u, c] + across * colors[v + 1, u + 1, c]
                made[y, x, c] = (1 - down) * upper + down * lower
