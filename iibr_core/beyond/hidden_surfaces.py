"""The surfaces behind the photo's, which an open lens sees past their edges.

The farthest views of a light field have inpainted some of it, and a wide lens sees more. Their content comes first, so
that a picture through the lens agrees with all views; the rest is inpainted in the same way.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import encoded_from_stored
from iibr_core.inpainting.background import fill_background
from iibr_core.method.mixed_pixels import split_mixed_pixels
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.scalars import nearest_pixel
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.surfaces import EDGE_PX, is_in_front, step_of
from iibr_core.types import CENTRE, FloatImage, StoredColors, ViewOffset

DIAGONAL = math.sqrt(2)
STRAY = 0.5
"""Share of the size of a depth edge by which a filled disparity must lie behind the photo's."""
MIXED_PX = 3
"""Distance from a nearer surface up to which the pixels of a view may show some of it, in pixels."""


@dataclass(frozen=True, eq=False)
class SeenBehind:
    """A view at `offset` that sees behind the photo's surfaces.

    colors (H, W, 3), disparity (H, W). mask (H, W): the pixels that the photo does not show, None if unknown.
    """

    offset: ViewOffset
    colors: StoredColors
    disparity: FloatImage
    mask: NDArray[np.bool_] | None


@dataclass(frozen=True, eq=False)
class HiddenSurface:
    """The surface behind the photo's, and the photo's own where nothing is hidden: another eye may see it behind.

    colors (H, W, 3): sRGB-encoded. disparity (H, W). mask (H, W): where it is known.
    """

    colors: FloatImage
    disparity: FloatImage
    mask: NDArray[np.bool_]


def hidden_surface(
    colors: FloatImage, disparity: FloatImage, lens_radius: float, seen: Iterable[SeenBehind] = (), threads: int = 1
) -> HiddenSurface:
    """Return what a lens in the middle of a photo (H, W, 3) with disparity (H, W) sees behind its surfaces.

    lens_radius: of the widest lens, in view steps. seen: views that have seen some of it.
    """
    edge = step_of(EDGE_PX, lens_radius)
    hidden = np.empty(disparity.shape, np.float32)
    _lowest_within_reach(disparity, 1 / max(lens_radius, 1e-9), hidden)
    hole = hidden < disparity - edge
    if not hole.any():
        return HiddenSurface(colors, disparity, ~hole)
    background = np.ascontiguousarray(split_mixed_pixels(colors, disparity, edge)[0])
    behind, known = disparity.copy(), ~hole
    for view in seen:
        raise_if_stopped()
        mask = np.ones(behind.shape, np.bool_) if view.mask is None else view.mask
        view_colors = np.ascontiguousarray(encoded_from_stored(view.colors), np.float32)
        _land(view_colors, view.disparity, mask, *map(float, view.offset), disparity, edge, (background, behind, known))
    open_hole = hole & ~known
    if open_hole.any():
        fill_background(background, behind, open_hole, disparity, CENTRE, threads, farthest_views=lens_radius)
    return HiddenSurface(background, behind, ~hole | (behind < disparity - STRAY * edge))


@kernel
def _lowest_within_reach(disparity, slope, lowest):
    """Write the least disparity (H, W) around each pixel, raised by `slope` for each pixel of distance."""
    (height, width), diagonal = disparity.shape, slope * DIAGONAL
    lowest[:] = disparity
    # Two passes, each from the pixels that it has visited: down and to the right, then back.
    for way in (1, -1):
        for j in range(height):
            y = j if way > 0 else height - 1 - j
            for i in range(width):
                x = i if way > 0 else width - 1 - i
                for v, u, rise in (
                    (y - way, x - 1, diagonal), (y - way, x, slope), (y - way, x + 1, diagonal), (y, x - way, slope)
                ):  # fmt: skip
                    if 0 <= v < height and 0 <= u < width:
                        lowest[y, x] = min(lowest[y, x], lowest[v, u] + rise)


@kernel
def _is_beside_foreground(disparity, y, x, edge):
    """Return whether a pixel may be mixed with a nearer surface: one lies within MIXED_PX of it."""
    height, width = disparity.shape
    for v in range(max(y - MIXED_PX, 0), min(y + MIXED_PX + 1, height)):
        for u in range(max(x - MIXED_PX, 0), min(x + MIXED_PX + 1, width)):
            if is_in_front(disparity[v, u], disparity[y, x], edge):
                return True
    return False


@kernel
def _land(colors, disparity, mask, t, s, photo_disparity, edge, surface):
    """Write the pixels of a view that land behind the photo's surfaces, the nearest first, into (colours, disparity,
    known).
    """
    hidden_colors, behind, known = surface
    height, width = disparity.shape
    for y in range(height):
        for x in range(width):
            d = disparity[y, x]
            if not (mask[y, x] and d == d):
                continue
            v, u = nearest_pixel(y + d * t), nearest_pixel(x + d * s)
            if not (0 <= v < height and 0 <= u < width and is_in_front(photo_disparity[v, u], d, edge)):
                continue
            if behind[v, u] < photo_disparity[v, u] and behind[v, u] >= d:
                continue
            if _is_beside_foreground(disparity, y, x, edge):
                continue
            behind[v, u], known[v, u] = d, True
            for c in range(3):
                hidden_colors[v, u, c] = colors[y, x, c]
