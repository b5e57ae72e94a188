"""A light field in the order that its views show, and the coarse disparity of its centre view."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from iibr_core.depth.multi_view.estimate import CoarseDisparity, estimate_coarse
from iibr_core.depth.multi_view.matching import choose_views, luma_of
from iibr_core.depth.multi_view.near_side import nearness_ratio
from iibr_core.depth.multi_view.order_by_parallax import Fit, Verdict, find_order
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.light_fields.order import (
    FLIPS,
    UNKNOWN,
    Arrangement,
    Flip,
    arranged,
    as_given,
    grid_of,
    is_quilt,
)
from iibr_core.formats.light_fields.views import in_order_of, view_offsets
from iibr_core.remedies import FixableError, Remedy
from iibr_core.types import FloatImage, ViewOffset, ViewUpdate, image_size

CLEAR_RATIO, FINAL_CLEAR_RATIO = 1.4, 1.15
"""Ratios of `nearness_ratio` that decide, by a coarse map and by the final one."""
COMPARED_VIEWS, COMPARED_PX = 8, 320
"""Number of views in which hidden places are compared, and the longer side of their copies."""
ORDER_WORDS = {
    "rows": "",
    "columns": "columns are counted before rows",
    "snake": "every other row runs backwards",
    "snake-columns": "columns are counted before rows, every other one backwards",
}
FLIP_WORDS = {
    "none": "",
    "x": "columns run from right to left",
    "y": "rows run from bottom to top",
    "xy": "rows run from bottom to top and columns from right to left, as seen from behind",
}
TILE_WORDS = {
    "none": "",
    "x": "tiles are counted from the bottom right",
    "y": "tiles are counted from the top left",
    "xy": "tiles are counted from the top right",
}

UNSURE = "Near and far may be exchanged, as little hides anything behind it: flip both axes to turn them round."
DOUBTS: dict[Verdict, str] = {
    "clear": "",
    "silent": "The views are taken in {order}: too little of them is found again in others to test it.",
    "contrary": "The views are taken in {order}, though their parallax fits none: if depth looks wrong, try another.",
}


@dataclass(frozen=True, eq=False)
class Settled:
    """A light field in the right order.

    views: all views, the centre and those near it first. offsets: their viewpoints from it. coarse: its disparity.
    arrangement: the order, UNKNOWN where the layout is sure of it. measured: number of views that show the order, 0 if
    they do not. verdict: of its test by parallax. is_sure: whether near and far cannot be exchanged. named: the field
    in the order of its names. is_left: see `settle`.
    """

    field: MultiView
    views: list[ViewUpdate]
    offsets: list[ViewOffset]
    coarse: CoarseDisparity
    arrangement: Arrangement
    measured: int
    is_sure: bool
    named: MultiView
    verdict: Verdict = "clear"
    is_left: bool = False

    @property
    def notes(self) -> tuple[str, ...]:
        """Notes of the field, and one about the order of its views where names state another."""
        return (*self.field.notes, *_notes_on_order(self))


def settle(
    field: MultiView, views: Sequence[ViewUpdate], given: Arrangement = UNKNOWN, is_left: bool = False
) -> Settled:
    """Return a light field in the order that its views show.

    views: all views of the field, on its grid. given: what the user has decided. is_left: whether the left view of a
    pair counts as its centre, not the right one, which is the centre of its grid. Raises InputError if the views
    contradict every order, or are too small for their disparity to be found.
    """
    ordered = in_order_of(field, views)
    fit: Fit | None = None
    verdict: Verdict = "clear"
    if field.numbers or given != UNKNOWN:
        fit, verdict = find_order(field, [view.colors for view in ordered], given)
    if fit is None and field.is_guess and given.order is None:
        raise FixableError(
            f"{field.place}: holds no light field; its {len(views)} numbered pictures do not look like views from a"
            " grid or a row",
            Remedy.VIEW_ORDER,
        )
    if fit is None:
        order = UNKNOWN if given == UNKNOWN else as_given(field, given)
        return replace(_placed(field, ordered, order, 0, is_sure=True, is_left=is_left), verdict=verdict)
    is_sure = given.flip is not None
    settled = _placed(field, ordered, fit.arrangement, len(fit.places), is_sure, is_left)
    return settled if settled.is_sure else _faced(settled, settled.coarse.values, CLEAR_RATIO)


def confirm(settled: Settled, values: FloatImage) -> Settled:
    """Return the field, turned round if the final disparity (H, W) of its centre shows that it is seen from behind.

    Then its disparity must be found again.
    """
    return settled if settled.is_sure else _faced(settled, values, FINAL_CLEAR_RATIO)


def _placed(
    named: MultiView,
    views: Sequence[ViewUpdate],
    arrangement: Arrangement,
    measured: int,
    is_sure: bool,
    is_left: bool,
) -> Settled:
    """Return a field in this order. views: in the order of the field's own."""
    field = named if arrangement == UNKNOWN else arranged(named, arrangement)
    moved = [
        replace(view, row=known.place[0], column=known.place[1])
        for view, known in zip(views, field.views)
        if known.place is not None
    ]
    offsets, places = view_offsets(field), [(view.row, view.column) for view in moved]
    centre = field.centre if is_left else places.index(grid_of(field).centre)
    offsets = [ViewOffset(t - offsets[centre].t, s - offsets[centre].s) for t, s in offsets]
    coarse = estimate_coarse([view.colors for view in views], offsets, centre)
    near_first = sorted(range(len(moved)), key=lambda k: (k != centre, math.hypot(*offsets[k])))
    views, offsets = [moved[k] for k in near_first], [offsets[k] for k in near_first]
    return Settled(field, views, offsets, coarse, arrangement, measured, is_sure, named, is_left=is_left)


def _faced(settled: Settled, values: FloatImage, clear_ratio: float) -> Settled:
    """Return the field, turned round if what it hides shows that it is seen from behind. values: of its centre."""
    chosen = [0, *choose_views(settled.offsets, 0)[1:][-COMPARED_VIEWS:]]
    size = image_size(values)
    shrink = -(-max(size) // COMPARED_PX)
    height, width = (length // shrink for length in size)
    small = values[shrink // 2 :: shrink, shrink // 2 :: shrink][:height, :width] / np.float32(shrink)
    lumas = [luma_of(settled.views[k].colors, shrink) for k in chosen]
    ratio = nearness_ratio(lumas, [settled.offsets[k] for k in chosen], small)
    if ratio >= 1 / clear_ratio:
        return replace(settled, is_sure=ratio > clear_ratio)
    ordered = in_order_of(settled.field, settled.views)
    return _placed(settled.named, ordered, _turned(settled), settled.measured, True, settled.is_left)


def _turned(settled: Settled) -> Arrangement:
    """Return the arrangement seen from behind."""
    arrangement = settled.arrangement
    assert arrangement.grid is not None
    is_all = _is_tiled(settled)
    axes = {axis for axis, length in zip("yx", arrangement.grid) if length > 1 or is_all}
    flips: dict[str, Flip] = {flip: flip for flip in FLIPS}
    return replace(arrangement, flip=flips["".join(sorted(axes ^ (set("xy") & set(arrangement.flip or "")))) or "none"])


def _is_tiled(settled: Settled) -> bool:
    """Return whether the views are one line, counted along the tiles of a quilt."""
    return is_quilt(settled.named) and settled.arrangement.grid == settled.named.grid


def _notes_on_order(settled: Settled) -> tuple[str, ...]:
    """Return a sentence about an order, none if it is that of the names."""
    found, named, words = settled.arrangement, settled.named, []
    is_folder = named.place != named.views[0].path  # a quilt states its order
    if settled.measured == 0 or found.grid is None:
        doubt = DOUBTS[settled.verdict].format(
            order="the order of their names" if found == UNKNOWN else "the given order"
        )
        return (doubt,) if doubt and (is_folder or settled.verdict == "contrary") else ()
    if len(named.views) > 2 and (named.is_guess or found.grid != named.grid):
        words.append(f"{found.grid.rows} rows of {found.grid.columns}" if min(found.grid) > 1 else "one line of views")
    flips = TILE_WORDS if _is_tiled(settled) else FLIP_WORDS
    words += filter(None, (ORDER_WORDS[found.order or "rows"], flips[found.flip or "none"]))
    if found.row_step not in (None, 1.0):
        words.append(f"rows are {found.row_step:.2g} times as far apart as columns")
    order = f"The parallax of {settled.measured} views shows their order: {', '.join(words)}." if words else ""
    return tuple(filter(None, (order, UNSURE if not settled.is_sure and (words or is_folder) else "")))
