"""The fine texture of what surrounds a hole, carried into it: smooth colours alone would show where it was.

Only fine texture can be guessed, for nobody sees that its place is wrong. It is carried in pieces, not pixel by pixel:
pixels that come from all over are noise, which looks like no surface and does not survive resampling in other views.
"""

from __future__ import annotations

import numpy as np

from iibr_core.inpainting.nearest_known import DIRECTIONS
from iibr_core.runtime.jit import kernel

MOST_TEXTURE = np.float32(0.08)
"""Differences larger than this are lines, and no texture."""
BINOMIAL = np.array([1, 4, 6, 4, 1], np.float32) / 16
"""Texture is what differs from a mean with these weights, each way."""
STEP_PX = 12
"""Texture comes from multiples of this away, so that neighbouring pixels come from neighbouring places."""
MULTIPLES = 6


@kernel
def carry_texture(colors, disparity, mixed, pixels, one_surface, texture):
    """Write texture (N, 3) for hole pixels, flat indices (N,): that of the first place which shows their own surface.

    Places are tried from the inside out, in all DIRECTIONS; where none does there is no texture. mixed (H, W): holes,
    and what may show no surface purely. Surfaces are one whose disparities differ by one_surface at most.
    """
    height, width = mixed.shape
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        d = disparity[y, x]
        for n in range(MULTIPLES * len(DIRECTIONS)):
            across, down = DIRECTIONS[n % len(DIRECTIONS)]
            away = STEP_PX * (1 + n // len(DIRECTIONS)) // max(abs(across), abs(down))
            v, u = y + away * down, x + away * across
            is_inside = 0 <= v < height and 0 <= u < width
            if is_inside and not mixed[v, u] and abs(disparity[v, u] - d) <= one_surface:
                _difference(colors, disparity, mixed, v, u, d, one_surface, texture[i])
                if max(abs(texture[i, 0]), abs(texture[i, 1]), abs(texture[i, 2])) <= MOST_TEXTURE:
                    break
            texture[i, 0] = texture[i, 1] = texture[i, 2] = 0.0


@kernel
def _difference(colors, disparity, mixed, y, x, d, one_surface, difference):
    """Of a pixel's colour from the mean of its surface around it, (3,)."""
    height, width = mixed.shape
    total = red = green = blue = np.float32(0.0)
    for j in range(-2, 3):
        for i in range(-2, 3):
            v, u = y + j, x + i
            if 0 <= v < height and 0 <= u < width and not mixed[v, u] and abs(disparity[v, u] - d) <= one_surface:
                weight = BINOMIAL[j + 2] * BINOMIAL[i + 2]
                total, red = total + weight, red + weight * colors[v, u, 0]
                green, blue = green + weight * colors[v, u, 1], blue + weight * colors[v, u, 2]
    for c, mean in enumerate((red / total, green / total, blue / total)):
        difference[c] = colors[y, x, c] - mean
