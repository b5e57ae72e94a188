"""Pixels at depth edges show two surfaces at once. Left whole, they trail a rim of foreground colour into the
background.

A pixel on the far side of a depth edge whose colour lies between both surfaces is split: the background keeps its own
colour, and the foreground gets a fringe ray there that covers the pixel's share alpha. Both together are the pixel
again.
"""

from __future__ import annotations

import numpy as np

from iibr_core.runtime.jit import kernel, linear_scalar, srgb_scalar
from iibr_core.runtime.tiling import ShouldStop, in_bands, never
from iibr_core.types import FloatImage, image_size

LEAST_SHARE = 0.05
"""Smaller shares of foreground are noise."""
LEAST_CONTRAST = 0.05
"""Distance of the two surfaces' colours in linear light below which a share cannot be told."""
MOST_RESIDUAL = 0.1
"""How far, relative to their contrast squared, a pixel's colour may lie off the line between the two surfaces."""
DIAGONAL = 0.99
"""Prefers a straight neighbour to a diagonal one with the same disparity."""


def split_mixed_pixels(
    colors: FloatImage, disparity: FloatImage, edge_step: float, should_stop: ShouldStop = never
) -> tuple[FloatImage, FloatImage, FloatImage, FloatImage]:
    """The photo's own rays and its fringe, for a photo (H, W, 3), its disparity (H, W) and the step that counts as a
    depth edge.

    Returns (own colours (H, W, 3), fringe colours (H, W, 3), fringe disparity (H, W), fringe coverage (H, W)); where
    there is no fringe its coverage is 0 and its disparity NaN. Raises Cancelled once should_stop is true.
    """
    own, fringe = np.empty_like(colors, order="C"), np.empty_like(colors, order="C")
    fringe_disparity, coverage = np.empty_like(disparity, order="C"), np.empty_like(disparity, order="C")

    def band(first: int, last: int) -> None:
        own[first:last] = fringe[first:last] = colors[first:last]
        fringe_disparity[first:last], coverage[first:last] = np.nan, 0.0
        _split_rows(colors, disparity, edge_step, first, last, own, fringe, fringe_disparity, coverage)

    in_bands(band, image_size(disparity), should_stop)
    return own, fringe, fringe_disparity, coverage


@kernel
def _towards_front(disparity, x, y, edge_step):
    """Direction to the neighbour most in front by more than edge_step; (0, 0) if none, or if one is as far behind."""
    here = disparity[y, x]
    best, step_x, step_y = edge_step, 0, 0
    for j in range(-1, 2):
        for i in range(-1, 2):
            step = disparity[y + j, x + i] - here
            if i != 0 and j != 0:
                step *= DIAGONAL
            # In front of something itself: no background that the foreground mixes into.
            if step < -edge_step:
                return 0, 0
            if step > best:
                best, step_x, step_y = step, i, j
    return step_x, step_y


@kernel
def _split_rows(
    colors, disparity, edge_step, first, last, own, fringe, fringe_disparity, coverage,
):  # fmt: skip
    """Rows [first, last) of what `split_mixed_pixels` returns, which hold the photo where nothing is split."""
    height, width = disparity.shape
    front, back, here = np.empty(3), np.empty(3), np.empty(3)
    # Colours are looked up two pixels away at most.
    for y in range(max(first, 2), min(last, height - 2)):
        for x in range(2, width - 2):
            # A pixel just behind an edge: the foreground on one side, its own surface on the other.
            i, j = _towards_front(disparity, x, y, edge_step)
            if (i == 0 and j == 0) or abs(disparity[y - j, x - i] - disparity[y, x]) > edge_step:
                continue
            # The foreground's colour, from one pixel beyond where it is that wide: the neighbour may be mixed itself.
            front_disparity = disparity[y + j, x + i]
            reach = 2 if abs(disparity[y + 2 * j, x + 2 * i] - front_disparity) <= edge_step else 1
            contrast = along = 0.0
            # Matting on the line between both colours: share = (here - back) (front - back) / |front - back|^2.
            for c in range(3):
                front[c] = linear_scalar(colors[y + reach * j, x + reach * i, c])
                back[c] = linear_scalar(colors[y - j, x - i, c])
                here[c] = linear_scalar(colors[y, x, c])
                along += (here[c] - back[c]) * (front[c] - back[c])
                contrast += (front[c] - back[c]) ** 2
            # Surfaces of one colour: the pixel tells nothing about shares.
            if not contrast >= LEAST_CONTRAST**2:
                continue
            share = min(max(along / contrast, 0.0), 1.0)
            # Off the line it is some third colour, and no mix.
            residual = 0.0
            for c in range(3):
                residual += (here[c] - share * front[c] - (1.0 - share) * back[c]) ** 2
            if share < LEAST_SHARE or residual > MOST_RESIDUAL * contrast:
                continue
            for c in range(3):
                # The better-determined of the two takes the residual, so that both together are the pixel again.
                if share < 0.5:
                    back[c] = max((here[c] - share * front[c]) / (1.0 - share), 0.0)
                else:
                    front[c] = max((here[c] - (1.0 - share) * back[c]) / share, 0.0)
                own[y, x, c] = srgb_scalar(back[c])
                fringe[y, x, c] = srgb_scalar(front[c])
            # The fringe ray moves with the foreground and covers its share; the own ray stays and fills the pixel.
            fringe_disparity[y, x] = front_disparity
            coverage[y, x] = share
