"""The fine texture of what surrounds a hole, mirrored into it: smooth colours alone would show where it was.

Only fine texture can be guessed, for nobody sees that its place is wrong.
"""

from __future__ import annotations

import numpy as np

from iibr_core.runtime.jit import kernel, nearest_pixel

TEXTURE_SHARE = np.float32(0.9)
"""So much of it is added: a guess is off by less that way."""
MOST_TEXTURE = np.float32(0.1)
"""Differences larger than this are lines, and no texture."""
BINOMIAL = np.array([1, 4, 6, 4, 1], np.float32) / 16
"""Texture is what differs from a mean with these weights, each way."""
TRIES = 6
NEARER = 0.6
"""Where the mirrored place does not show the surface, one so much nearer to the rim is tried."""


@kernel
def mirror_texture(colors, disparity, hole, pixels, known, one_surface, texture):
    """Write texture (N, 3) for hole pixels, flat indices (N,): that of their own surface as far behind the rim.

    known: as `nearest_known` returns. Surfaces are one whose disparities differ by one_surface at most.
    """
    height, width = hole.shape
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        d = disparity[y, x]
        for c in range(3):
            texture[i, c] = 0.0
        # The nearest known pixel of the surface, ...
        down, across, nearest = 0, 0, np.inf
        for k in range(known.shape[1]):
            v, u = known[i, k] // width, known[i, k] % width
            if known[i, k] < 0 or abs(disparity[v, u] - d) > one_surface:
                continue
            if (v - y) ** 2 + (u - x) ** 2 < nearest:
                down, across, nearest = v - y, u - x, float((v - y) ** 2 + (u - x) ** 2)
        # ... and as far behind it as the hole's pixel lies before it, or less far.
        behind = 1.0
        for _ in range(TRIES):
            v, u = nearest_pixel(y + (1.0 + behind) * down), nearest_pixel(x + (1.0 + behind) * across)
            is_inside = 0 <= v < height and 0 <= u < width
            if nearest < np.inf and is_inside and not hole[v, u] and abs(disparity[v, u] - d) <= one_surface:
                _difference(colors, disparity, hole, v, u, d, one_surface, texture[i])
                break
            behind *= NEARER


@kernel
def _difference(colors, disparity, hole, y, x, d, one_surface, difference):
    """Of a pixel's colour from the mean of what is known of its surface around it, (3,)."""
    height, width = hole.shape
    total = red = green = blue = np.float32(0.0)
    for j in range(-2, 3):
        for i in range(-2, 3):
            v, u = y + j, x + i
            if 0 <= v < height and 0 <= u < width and not hole[v, u] and abs(disparity[v, u] - d) <= one_surface:
                weight = BINOMIAL[j + 2] * BINOMIAL[i + 2]
                total, red = total + weight, red + weight * colors[v, u, 0]
                green, blue = green + weight * colors[v, u, 1], blue + weight * colors[v, u, 2]
    for c, mean in enumerate((red / total, green / total, blue / total)):
        difference[c] = min(max(TEXTURE_SHARE * (colors[y, x, c] - mean), -MOST_TEXTURE), MOST_TEXTURE)
