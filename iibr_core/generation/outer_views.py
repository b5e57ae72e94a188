"""The views that complete a ray set, and that cost is estimated by: one list. Imports nothing heavy."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass
from math import ceil
from typing import Literal

import numpy as np

from iibr_core.types import FloatImage, GridShape, Margins, ViewOffset

MOST_MARGIN = 0.25
"""Of the photo's height or width: what views see farther beyond its frame they fill themselves."""
NEARLY_ALL = 0.99
"""So much of a side of the frame counts: a few wild pixels do not make the canvas larger."""
LOOKUP_MARGIN_PX = 2
"""So much more of a margin, that look-ups at its end find their neighbours."""


@dataclass(frozen=True)
class WantedViews:
    """Which views of a grid are made beside the photo's own. offsets: None for all.

    seen: "each": as they are among all. "one": of one picture by a pinhole, so their fills need not be those of others.
    "sum": only their sum through a lens is, in which neither fills nor what the transformer says can be told.
    """

    offsets: Collection[ViewOffset] | None = None
    seen: Literal["each", "one", "sum"] = "each"


ALL_VIEWS = WantedViews()


def outer_views(offsets: Iterable[ViewOffset]) -> list[ViewOffset]:
    """The corners of the box around all viewpoints and the photo's own; each once, without that one.

    Together they see all but slivers of what any view in the box disoccludes: the middles of its sides would add
    0.02 dB on exact maps, less on others.
    """
    every = [ViewOffset(0.0, 0.0), *offsets]
    top, bottom = min(at.t for at in every), max(at.t for at in every)
    left, right = min(at.s for at in every), max(at.s for at in every)
    # Opposite ones first: between them they disocclude nearly all there is, so those after them find little left.
    corners = [(top, left), (bottom, right), (top, right), (bottom, left)]
    return [ViewOffset(*at) for at in dict.fromkeys(corners) if at != (0.0, 0.0)]


def outer_views_of_grid(grid: GridShape) -> list[ViewOffset]:
    """`outer_views` of all views of a grid."""
    return outer_views([grid.offset(0, 0), grid.offset(grid.rows - 1, grid.columns - 1)])


def outer_views_for(outer: Sequence[ViewOffset], wanted: WantedViews) -> list[ViewOffset]:
    """Those of the outer views that complete the ray set for the wanted ones. For each as among all: all. For a sum the
    first two, which come before all others and so decide most; for one picture also those on its side of the photo.
    """
    if wanted.offsets is None or wanted.seen == "each":
        return list(outer)
    beside = wanted.offsets if wanted.seen == "one" else ()
    return [far for far in outer if far in outer[:2] or any(_is_on_side_of(far, at) for at in beside)]


def _is_on_side_of(far: ViewOffset, at: ViewOffset) -> bool:
    t, s = far.t * at.t, far.s * at.s
    return t >= 0 and s >= 0 and (t > 0 or s > 0)


def farthest_views(outer: Iterable[ViewOffset]) -> float:
    """The largest view offset among these, 1 at least: what a ray set is made for."""
    return max([1.0, *(abs(part) for at in outer for part in at)])


def outpainting_margins(disparity: FloatImage, outer: Iterable[ViewOffset]) -> Margins:
    """How far beyond the frame of a photo with this disparity (H, W) the outer views see; 0 where they do not."""
    every = [ViewOffset(0.0, 0.0), *outer]
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
    """Of one side, whose pixels look outwards so many pixels per view step, in views from first to last."""
    reach = float(np.quantile(np.maximum(outwards * first, outwards * last), NEARLY_ALL))
    return min(ceil(reach) + LOOKUP_MARGIN_PX, int(MOST_MARGIN * length)) if reach > 0 else 0
