"""The fine texture of what surrounds a hole, carried into it: smooth colours alone would show where it was.

Only fine texture can be guessed, for nobody sees that its place is wrong. It is carried by whole tiles, each from where
its own surface has the same colours: pixels that come from all over are noise, which looks like no surface, and clutter
is no texture of what is smooth.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from iibr_core.inpainting.nearest_known import DIRECTIONS
from iibr_core.runtime.jit import kernel
from iibr_core.types import ImageSize

MOST_TEXTURE = np.float32(0.06)
"""Larger differences are lines, and no texture: of them so much is carried."""
BINOMIAL = np.array([1, 4, 6, 4, 1], np.float32) / 16
"""Texture is what differs from a mean with these weights, each way."""
TILE_PX = 8
PART_PX = 4
"""Places are compared by the mean colours of a tile's parts: single pixels would prefer what has no texture."""
STEP_PX = 12
MULTIPLES = 6
"""Texture comes from up to so many times this away, in all DIRECTIONS."""
PLACES = MULTIPLES * len(DIRECTIONS)
MISSING = 0.3
"""A pixel for which a place has nothing counts as much as one whose channels differ by this, all together."""


def tile_rows_and_columns(size: ImageSize) -> tuple[int, int]:
    """Of the tiles that an image of this size is cut into."""
    return -(-size.height // TILE_PX), -(-size.width // TILE_PX)


def tiles_of(pixels: NDArray[np.int64], size: ImageSize) -> NDArray[np.int64]:
    """(M,): the tiles of an image in which these pixels, flat indices, lie; counted row by row."""
    y, x = np.divmod(pixels, size.width)
    return np.unique(y // TILE_PX * tile_rows_and_columns(size)[1] + x // TILE_PX)


@kernel
def choose_places(colors, disparity, hole, mixed, tiles, one_surface, chosen):
    """Write for these tiles (M,) which of PLACES has their texture, -1 for none, to chosen (tile_rows_and_columns).

    It is the one where the hole's own surface looks most like what was filled. mixed (H, W): holes, and what may show
    no surface purely. Surfaces are one whose disparities differ by one_surface at most.
    """
    height, width = hole.shape
    columns = chosen.shape[1]
    for tile in tiles:
        top, left = tile // columns * TILE_PX, tile % columns * TILE_PX
        filled = hole[top : top + TILE_PX, left : left + TILE_PX].sum()
        chosen[tile // columns, tile % columns], least = -1, MISSING * filled
        for place in range(PLACES):
            down, across = _way(place)
            unlike = 0.0
            for part_y in range(top, min(top + TILE_PX, height), PART_PX):
                for part_x in range(left, min(left + TILE_PX, width), PART_PX):
                    red = green = blue = 0.0
                    for y in range(part_y, min(part_y + PART_PX, height)):
                        for x in range(part_x, min(part_x + PART_PX, width)):
                            if not hole[y, x]:
                                continue
                            v, u = y + down, x + across
                            if _is_own(disparity, mixed, v, u, disparity[y, x], one_surface):
                                red += colors[v, u, 0] - colors[y, x, 0]
                                green += colors[v, u, 1] - colors[y, x, 1]
                                blue += colors[v, u, 2] - colors[y, x, 2]
                            else:
                                unlike += MISSING
                    unlike += abs(red) + abs(green) + abs(blue)
                if unlike >= least:
                    break
            if unlike < least:
                chosen[tile // columns, tile % columns], least = place, unlike


@kernel
def carry_texture(colors, disparity, mixed, pixels, one_surface, chosen, texture):
    """Write texture (N, 3) for hole pixels, flat indices (N,): that of the place chosen for their tile, 0 where it does
    not show their own surface. The rest as in `choose_places`.
    """
    width = mixed.shape[1]
    for i in range(len(pixels)):
        y, x = pixels[i] // width, pixels[i] % width
        place = chosen[y // TILE_PX, x // TILE_PX]
        down, across = _way(max(place, 0))
        texture[i, 0] = texture[i, 1] = texture[i, 2] = 0.0
        if place >= 0 and _is_own(disparity, mixed, y + down, x + across, disparity[y, x], one_surface):
            _difference(colors, disparity, mixed, y + down, x + across, disparity[y, x], one_surface, texture[i])


@kernel
def _way(place):
    """Down and right to one of PLACES, from the inside out."""
    across, down = DIRECTIONS[place % len(DIRECTIONS)]
    away = STEP_PX * (1 + place // len(DIRECTIONS)) // max(abs(across), abs(down))
    return away * down, away * across


@kernel
def _is_own(disparity, mixed, v, u, d, one_surface):
    """Whether the surface at disparity d shows purely there."""
    height, width = mixed.shape
    return 0 <= v < height and 0 <= u < width and not mixed[v, u] and abs(disparity[v, u] - d) <= one_surface


@kernel
def _difference(colors, disparity, mixed, y, x, d, one_surface, difference):
    """Of a pixel's colour from the mean of its surface around it, (3,), MOST_TEXTURE at most."""
    total = red = green = blue = np.float32(0.0)
    for j in range(-2, 3):
        for i in range(-2, 3):
            if _is_own(disparity, mixed, y + j, x + i, d, one_surface):
                weight = BINOMIAL[j + 2] * BINOMIAL[i + 2]
                total, red = total + weight, red + weight * colors[y + j, x + i, 0]
                green = green + weight * colors[y + j, x + i, 1]
                blue = blue + weight * colors[y + j, x + i, 2]
    for c, mean in enumerate((red / total, green / total, blue / total)):
        difference[c] = colors[y, x, c] - mean
    most = max(abs(difference[0]), abs(difference[1]), abs(difference[2]))
    if most > MOST_TEXTURE:
        for c in range(3):
            difference[c] *= MOST_TEXTURE / most
