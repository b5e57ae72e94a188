"""The order of a light field's views, tested by their parallax: names of files are often wrong.

A few views are measured (`viewpoints.py`). Every order that names admit gives them places on a grid; in the right
order, their viewpoints lie on a grid along the axes of the picture. It also shows which way rows and columns are
counted, and how far apart rows are, but for a common sign: see `near_side.py`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.multi_view.matching import luma_of
from iibr_core.depth.multi_view.viewpoints import LONGEST_PX, SEARCH_SHARE, Viewpoints, measure_viewpoints
from iibr_core.formats.light_fields.multi_view_scene import GridIndex, MultiView
from iibr_core.formats.light_fields.order import (
    UNKNOWN,
    Arrangement,
    Flip,
    numbers_of,
    places_in,
    possible_arrangements,
)
from iibr_core.remedies import FixableError, Remedy
from iibr_core.types import StoredColors, image_size

MAX_MEASURED = 16
"""Largest number of views that are measured."""
MAX_STRAY, MAX_STRAY_ON_LINE = 0.5, 1.5
"""Largest distance of a measured viewpoint from its place, in steps, on a grid and in a single row or column. A
camera on a rail is moved by uneven steps; views of a Lytro camera lie closer together at the edge of its lens.
"""
MAX_STRAY_SHARE = 0.125
"""Largest such distance on a short line, as a share of its half."""
MIN_FITTING = 0.8
"""Smallest share of the measured views that must lie at their places; the others may be mistaken."""
ROUNDS = 3
MAX_SKEW = 0.2
"""Largest tangent of the angle between the axes of a grid and those of the picture."""
MIN_MEASURED = 4
"""Fewest measured views that decide between orders, unless there are fewer."""
EQUAL_STEPS, EQUAL_STATED_STEPS = 0.06, 0.25
"""Largest difference of the distances between rows and between columns that may be an error of measuring, of any names
and of a layout whose rows usually stand as far apart as columns.
"""
Verdict = Literal["clear", "silent", "contrary"]
"""Result of the test of the order of views by parallax: one order fits, nothing is known, or none fits."""


@dataclass(frozen=True)
class Fit:
    """An arrangement that fits. steps: of a row down and of a column to the right, up to a common factor; 0 where the
    grid has one row or column only. stray: distance of views from their places, in steps. measured: number of views.
    """

    arrangement: Arrangement
    steps: tuple[float, float]
    stray: float
    measured: int


def find_order(
    scene: MultiView, views: Sequence[StoredColors], given: Arrangement = UNKNOWN
) -> tuple[Fit | None, Verdict]:
    """Return the arrangement that the parallax of the views shows, None if it shows none, and the verdict.

    views: colours (H, W, 3) of each view of the scene. given: what the user has decided. Its flip is a first guess: the
    names' own, or rows from bottom to top. Raises InputError if the views contradict every order, and neither the user
    nor the layout states one.
    """
    possible, numbers = possible_arrangements(scene, given), numbers_of(scene)
    places = [places_in(numbers, arrangement) for arrangement in possible]
    reference = scene.centre
    chosen = _views_to_measure(places, reference)
    if not chosen:
        return None, "silent"
    found = _measure([views[k] for k in (reference, *chosen)])
    fits = [
        fit
        for arrangement, at in zip(possible, places)
        if (fit := _fit(arrangement, np.array([at[k] for k in chosen], float) - at[reference], found)) is not None
    ]
    if fits:
        fit = _with_flip(min(fits, key=lambda fit: round(fit.stray, 1)), scene, given)
        is_told = scene.is_stated and given == UNKNOWN
        return (None, "silent") if is_told and fit.measured < len(chosen) / 2 else (fit, "clear")
    if found.is_measured.sum() < min(MIN_MEASURED, len(chosen)):
        return None, "silent"
    if scene.is_stated or given.order is not None:
        return None, "contrary"
    if scene.is_guess:
        raise FixableError(
            f"{scene.place}: holds no light field, or in an unusual order: the parallax of its {len(views)} numbered"
            " pictures fits none",
            Remedy.VIEW_ORDER,
        )
    raise FixableError(
        f"{scene.place}: the parallax of its views fits no order that their names suggest", Remedy.VIEW_ORDER
    )


def _measure(views: Sequence[StoredColors]) -> Viewpoints:
    """Return the viewpoints of views from the first, searched twice as far in smaller copies if few are measured."""
    for search in (1, 2):
        shrink = max(round(max(image_size(views[0])) * search / LONGEST_PX), 1)
        reference, *others = (luma_of(view, shrink) for view in views)
        found = measure_viewpoints(reference, others, search * SEARCH_SHARE)
        if found.is_measured.sum() >= min(MIN_MEASURED, len(others)):
            break
    return found


def views_around(places: Sequence[GridIndex], reference: int) -> list[int]:
    """Return up to MAX_MEASURED views on eight rays from a reference, by index: the nearest, and some farther ones."""
    return _choose(_ranks(places, reference))


def _views_to_measure(orders: Sequence[Sequence[GridIndex]], reference: int) -> list[int]:
    """Return the same of the orders that are possible: a view counts as near if it is in any of them."""
    ranks: dict[int, float] = {}
    for places in orders:
        for index, rank in _ranks(places, reference).items():
            ranks[index] = min(ranks.get(index, math.inf), rank)
    return _choose(ranks)


def _ranks(places: Sequence[GridIndex], reference: int) -> dict[int, float]:
    """Return the distances of views on eight rays from a reference."""
    row, column = places[reference]
    steps = {
        index: sorted((abs(r - row), abs(c - column))) for index, (r, c) in enumerate(places) if index != reference
    }
    return {index: most + 0.1 * least for index, (least, most) in steps.items() if least in (0, most)}


def _choose(ranks: dict[int, float]) -> list[int]:
    ordered = sorted(ranks, key=lambda index: ranks[index])
    near, far = ordered[: MAX_MEASURED // 2], ordered[MAX_MEASURED // 2 :]
    spread = np.linspace(0, len(far) - 1, min(len(far), MAX_MEASURED // 2)).round().astype(int)
    return near + [far[k] for k in dict.fromkeys(spread.tolist())]


def _fit(arrangement: Arrangement, places: NDArray[np.float64], found: Viewpoints) -> Fit | None:
    """Return how measured viewpoints fit an arrangement, None if they contradict it or do not suffice.

    places: (N, 2), row and column of each view from the reference.
    """
    assert arrangement.grid is not None
    is_measured, lengths = found.is_measured, arrangement.grid
    places, offsets, weights = (
        places[is_measured].astype(float),
        found.offsets[is_measured],
        found.agreeing[is_measured],
    )
    used = [axis for axis in (0, 1) if lengths[axis] > 1]
    if len(places) < min(MIN_MEASURED, len(is_measured)) or not all(np.any(places[:, axis]) for axis in used):
        return None
    axes, is_kept = np.zeros((2, 2)), np.ones(len(places), np.bool_)  # rows: (t, s) of a step down, of one to the right
    for _ in range(ROUNDS):
        root = np.sqrt(weights[is_kept])[:, None]
        axes[used] = np.linalg.lstsq(places[is_kept][:, used] * root, offsets[is_kept] * root, rcond=None)[0]
        away = np.hypot(*(offsets - places @ axes).T)
        is_kept = away <= np.quantile(away, MIN_FITTING)
    along, across = axes.diagonal()[used], axes[:, ::-1].diagonal()[used]
    if not (np.abs(along) > 0).all() or (np.abs(across) > MAX_SKEW * np.abs(along)).any():
        return None
    lengths_of_steps = np.abs(axes.diagonal()) if len(used) == 2 else np.abs(along)
    stray = float(np.quantile(np.hypot(*((offsets - places @ axes) / lengths_of_steps).T), MIN_FITTING))
    max_stray = MAX_STRAY if len(used) == 2 else min(MAX_STRAY_ON_LINE, MAX_STRAY_SHARE * np.abs(places).max())
    if stray > max_stray:
        return None
    return Fit(arrangement, (float(axes[0, 0]), float(axes[1, 1])), stray, len(places))


def _with_flip(fit: Fit, scene: MultiView, given: Arrangement) -> Fit:
    """Return the fit with the flip that its steps suggest, and the distance of rows."""
    down, across = fit.steps
    flip: Flip = given.flip or fit.arrangement.flip or ("y" if down * across < 0 else "none")
    ratio = abs(down / across) if down and across else 1.0
    equal = EQUAL_STATED_STEPS if scene.is_stated else EQUAL_STEPS
    row_step = 1.0 if abs(ratio - 1) <= equal else round(ratio, 3)
    return replace(fit, arrangement=replace(fit.arrangement, flip=flip, row_step=row_step))
