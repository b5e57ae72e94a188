"""The order of a light field's views, tested by their parallax: names of files are often wrong.

Every order that names admit gives views places on a grid. In the right one, and with the right distance of rows, a
plane sweep over a few small views matches best. That also shows which way rows and columns are counted, but for a
common sign: see `near_side.py`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.multi_view.matching import STEP_PX, match_at, texture_of
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.light_fields.order import (
    UNKNOWN,
    Arrangement,
    Flip,
    numbers_of,
    places_in,
    possible_arrangements,
)
from iibr_core.remedies import FixableError, Remedy
from iibr_core.runtime import tiling
from iibr_core.runtime.tiling import in_pieces
from iibr_core.types import FloatImage, StoredColors, image_size

SMALL_PX = 96
"""Longer side of the small views that are matched, about."""
MAX_MATCHED = 16
"""Largest number of views that are matched with the reference."""
MAX_SHIFT_SHARE = 0.25
"""Largest shift of the farthest view that is tried, as a share of the longer side."""
ROW_STEPS, ROW_STEP_CHANGES = (0.4, 2.5), (1.4, 1.2, 1.1, 1.05, 1.02)
"""Distances between rows, in distances between columns, that are tried beside 1, and factors to the best one."""
LIKELY_ORDERS = 4
"""Number of orders, with rows counted either way, with which they are tried: the best ones."""
EVEN_FACTOR = 1.1
"""Factor by which views must match better with another distance between rows than with that of columns."""
MIN_DIFFERENCE = 0.001
"""Difference of texture (1 = white) by which a pixel must match better in one order than in another to have a vote."""
MIN_VOTING, MIN_AGREEING = 0.005, 0.8
"""Smallest share of all pixels that must have a vote, and of these, of those that vote for the best order."""
MAX_DIFFERENCE_SHARE = 0.3
"""Largest difference, as a share of that over all disparities, of views that match in some order, as repeated ones do.
"""
EQUAL_STEPS = 0.06
"""Largest difference of the distances between rows and between columns that may be an error of measuring."""
Verdict = Literal["clear", "silent", "contrary"]
"""Result of the test of the order of views by parallax: one order fits, nothing is known, or none fits."""


@dataclass(frozen=True, eq=False)
class Fit:
    """An arrangement and how views match in it.

    places: (N, 2), row and column of the matched views from the reference. row_step: distance between rows, negative if
    they are counted against the columns. least, mean: difference of texture (H, W) at the best disparity, and over all.
    """

    arrangement: Arrangement
    places: NDArray[np.float64]
    row_step: float
    least: FloatImage
    mean: FloatImage

    @property
    def has_both_axes(self) -> bool:
        """Return whether the views do not lie in one row or column."""
        return bool(self.places.any(axis=0).all())

    def is_mirrored_by(self, other: Fit) -> bool:
        """Return whether another fit has the same order, or the opposite one, which parallax does not tell apart."""
        signed, others = (fit.places * (np.sign(fit.row_step), 1) for fit in (self, other))
        return np.array_equal(signed, others) or np.array_equal(signed, -others)


def find_order(
    scene: MultiView, views: Sequence[StoredColors], given: Arrangement = UNKNOWN
) -> tuple[Fit | None, Verdict]:
    """Return the arrangement that the parallax of the views shows, None if it shows none, and the verdict.

    views: colours (H, W, 3) of each view of the scene. given: what the user has decided. Its flip is a first guess: the
    names' own, or rows from bottom to top. Raises InputError if the views contradict every order, and neither the user
    nor the layout states one.
    """
    possible, numbers = possible_arrangements(scene, given), numbers_of(scene)
    if not possible:
        return None, "silent"
    places = np.array([places_in(numbers, arrangement) for arrangement in possible], float)
    reference = scene.centre
    chosen = _views_to_match(places, reference)
    if not chosen:
        return None, "silent"
    shrink = max(round(max(image_size(views[0])) / SMALL_PX), 1)
    textures = np.stack([texture_of(views[k], shrink) for k in (reference, *chosen)])
    brightness = textures.mean(axis=(1, 2), keepdims=True) + np.float32(1e-6)
    textures *= brightness[0] / brightness  # exposures may differ
    relative = places[:, chosen] - places[:, [reference]]
    fit, verdict = _best_fit(textures, dict(zip(possible, relative)))
    if fit is not None:
        return _with_flip(fit, given), verdict
    if verdict == "silent" or scene.is_stated or given.order is not None:
        return None, verdict
    if scene.is_guess:
        problem = "holds no light field, or in an unusual order: the parallax of its numbered pictures fits none"
    else:
        problem = "the parallax of its views fits no order that their names suggest"
    raise FixableError(f"{scene.place}: {problem}", Remedy.VIEW_ORDER)


def _views_to_match(places: NDArray[np.float64], reference: int) -> list[int]:
    """Return up to MAX_MATCHED views, by index, that lie on eight rays from a reference: near ones, and some far ones.

    places: (A, N, 2), row and column of each view in each arrangement; a view counts where it is nearest.
    """
    least, most = np.sort(np.abs(places - places[:, [reference]]), axis=2).transpose(2, 0, 1)
    is_on_ray = ((least == 0) | (least == most)) & (most > 0)
    away = np.where(is_on_ray, most + 0.1 * least, np.inf).min(axis=0)
    ordered: list[int] = np.argsort(away, kind="stable")[: np.count_nonzero(np.isfinite(away))].tolist()
    near, far = ordered[: MAX_MATCHED // 2], ordered[MAX_MATCHED // 2 :]
    spread = np.linspace(0, len(far) - 1, min(len(far), MAX_MATCHED // 2)).round().astype(int)
    return near + [far[k] for k in dict.fromkeys(spread.tolist())]


def _best_fit(
    textures: NDArray[np.float32], places: dict[Arrangement, NDArray[np.float64]]
) -> tuple[Fit | None, Verdict]:
    """Return the arrangement in which views match best, None if others do as well or none does, and the verdict.

    textures: (N + 1, H, W), the reference first. places: (N, 2) of the other views from it, by arrangement.
    """

    def match(arrangement: Arrangement, row_step: float) -> Fit:
        at = places[arrangement]
        return Fit(arrangement, at, row_step, *_match(textures, at * (row_step, 1)))

    tries = [(order, sign) for order, at in places.items() for sign in ((1, -1) if at.any(axis=0).all() else (1,))]
    fits = sorted(in_pieces(lambda tried: match(*tried), tries, tiling.THREADS), key=_misfit)
    uneven = [(fit, step) for fit in fits[:LIKELY_ORDERS] if fit.has_both_axes for step in ROW_STEPS]
    fits += in_pieces(lambda tried: match(tried[0].arrangement, tried[0].row_step * tried[1]), uneven, tiling.THREADS)
    fits.sort(key=_misfit)
    best = fits[0]
    still = replace(best, least=np.sqrt(np.square(textures[1:] - textures[0]).mean(axis=0)))
    next_best = min([fit for fit in fits if not fit.is_mirrored_by(best)] + [still], key=_misfit)
    better = next_best.least - best.least
    votes = np.abs(better) > MIN_DIFFERENCE
    if (still.least - best.least > MIN_DIFFERENCE).mean() < MIN_VOTING:
        return None, "silent"
    if votes.mean() < MIN_VOTING or (better[votes] > 0).mean() < MIN_AGREEING:
        return None, "contrary" if best.least.sum() > MAX_DIFFERENCE_SHARE * best.mean.sum() else "silent"
    even = match(best.arrangement, math.copysign(1, best.row_step))
    for change in ROW_STEP_CHANGES if best.has_both_axes else ():
        best = min([best, *(match(best.arrangement, best.row_step * change**k) for k in (1, -1))], key=_misfit)
    return even if _misfit(even) <= EVEN_FACTOR * _misfit(best) else best, "clear"


def _misfit(fit: Fit) -> float:
    """Return the mean difference."""
    return float(fit.least.mean())


def _match(textures: NDArray[np.float32], offsets: NDArray[np.float64]) -> tuple[FloatImage, FloatImage]:
    """Return the root mean square difference (H, W) of views at the best disparity, and that over all disparities.

    offsets: (N, 2), (t, s) of the views after the first.
    """
    from_reference = np.concatenate([np.zeros((1, 2)), offsets]).astype(np.float32)
    size, reach = image_size(textures[0]), float(np.abs(offsets).max())
    everything = np.ones((1, len(textures)), np.bool_)
    count = 2 * round(MAX_SHIFT_SHARE * max(size) / STEP_PX) + 1
    squares = np.empty((count, *size), np.float32)
    for k in range(count):
        disparity = np.float32((k - count // 2) * STEP_PX / reach)
        match_at(textures, from_reference, everything, disparity, squares[k : k + 1])
    # A parabola through the least value and its neighbours: parallax may be smaller than a step.
    middle = np.clip(squares.argmin(axis=0), 1, count - 2)
    before, least, after = (np.take_along_axis(squares, middle[None] + k, 0)[0] for k in (-1, 0, 1))
    bend = before - 2 * least + after
    least = np.where(bend > 0, least - (after - before) ** 2 / (8 * np.maximum(bend, 1e-12)), least)
    return np.sqrt(np.maximum(least, 0)), np.sqrt(squares.mean(axis=0))


def _with_flip(fit: Fit, given: Arrangement) -> Fit:
    """Return the fit with the flip that its steps suggest, and the distance of rows."""
    flip: Flip = given.flip or fit.arrangement.flip or ("y" if fit.row_step < 0 else "none")
    ratio = abs(fit.row_step)
    row_step = 1.0 if abs(ratio - 1) <= EQUAL_STEPS else round(ratio, 3)
    return replace(fit, arrangement=replace(fit.arrangement, flip=flip, row_step=row_step))
