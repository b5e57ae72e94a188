"""The views that complete a ray set: the farthest of the grid, and how far beyond the photo's frame they see.

Paper, section 3.4: farthest views first. Imports nothing heavy.
"""

from __future__ import annotations

from collections.abc import Iterable
from math import ceil

import numpy as np

from iibr_core.types import (
    CENTRE,
    FloatImage,
    GridShape,
    Margins,
    ViewOffset,
)

MAX_MARGIN = 0.25
"""Largest margin as a share of the photo's height or width: what lies beyond, each view fills by itself."""
FRAME_QUANTILE = 0.99
"""Share of a side of the frame that a margin is made for: a few wild pixels do not make the images larger."""
LOOKUP_MARGIN_PX = 2
"""Additional pixels, so that look-ups at the end of a margin find their neighbours."""


def outer_views(offsets: Iterable[ViewOffset]) -> list[ViewOffset]:
    """Return the corners of the box around all viewpoints and the photo's, each once, without the photo's.

    Together they see all but slivers of what any view in the box disoccludes: the middles of its sides would add
    0.02 dB on exact maps, less on others.
    """
    every = [CENTRE, *offsets]
    top, bottom = min(at.t for at in every), max(at.t for at in every)
    left, right = min(at.s for at in every), max(at.s for at in every)
    # Opposite corners first: together they disocclude nearly everything, so those after them find little left.
    corners = [(top, left), (bottom, right), (top, right), (bottom, left)]
    return [ViewOffset(*at) for at in dict.fromkeys(corners) if at != (0.0, 0.0)]


def outer_views_of_grid(grid: GridShape) -> list[ViewOffset]:
    """Return `outer_views` of all views of a grid."""
    return outer_views([grid.offset(0, 0), grid.offset(grid.rows - 1, grid.columns - 1)])


def farthest_views(outer: Iterable[ViewOffset]) -> float:
    """Return the largest view offset along an axis, at least 1: the distance that a ray set is made for."""
    return max([1.0, *(abs(part) for at in outer for part in at)])


def outpainting_margins(disparity: FloatImage, outer: Iterable[ViewOffset]) -> Margins:
    """Return how far beyond the frame of a photo with this disparity (H, W) the outer views see, in pixels."""
    every = [CENTRE, *outer]
    top, bottom = min(at.t for at in every), max(at.t for at in every)
    left, right = min(at.s for at in every), max(at.s for at in every)
    height, width = disparity.shape
    return Margins(
        _margin(-disparity[0], top, bottom, height),
        _margin(disparity[-1], top, bottom, height),
        _margin(-disparity[:, 0], left, right, width),
        _margin(disparity[:, -1], left, right, width),
    )


def _margin(outwards: FloatImage, first: float, last: float, length: int) -> int:
    """Return the margin of a side whose pixels move outwards by `outwards` per view step, for views first to last."""
    reach = float(np.quantile(np.maximum(outwards * first, outwards * last), FRAME_QUANTILE))
    return min(ceil(reach) + LOOKUP_MARGIN_PX, int(MAX_MARGIN * length)) if reach > 0 else 0
