"""The disparity of one view of a light field, or of a pair, from all of them: first small, to learn what there is, then
whole.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import encoded_from_stored
from iibr_core.depth.multi_view.agreement import find_confirmed
from iibr_core.depth.multi_view.gradient_refinement import refine_by_gradients
from iibr_core.depth.multi_view.matching import STEP_PX, MatchingViews, choose_views, luma_of, matching_views, sweep
from iibr_core.depth.multi_view.semi_global import choose_disparity
from iibr_core.formats.maps.resample import resample_surfaces
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.runtime.work import report_progress
from iibr_core.types import (
    FloatImage,
    InputError,
    StoredColors,
    ViewOffset,
    image_size,
)

FINDING = "finding disparity"
SMALL_SIDE_PX = 160
"""The longer side of the first, small map."""
MOST_SHIFT_SHARE = 0.4
"""Of the longer side: by which the farthest view's match may be shifted."""
SURE_MATCH = 0.4
"""From here on a match counts for the range of disparities."""
RARE = 0.002
"""Share of sure pixels at either end of the range that may be mistaken."""
MARGIN_STEPS = 4
"""Steps of the small sweep that are added to the range at both ends."""
MOST_STEPS = 512
CHOOSING_WORK = 0.35
"""Of choosing between the disparities of a sweep, for each of them, against its step of the sweep."""
REFINING_WORK = 14.0
"""What follows then takes as long as so many steps of a sweep, of whatever length."""
LEAST_SIDE_PX = 8
FEW_VIEWS = 4
"""So few match by chance in many places: their maps are checked against each other."""


@dataclass(frozen=True, eq=False)
class CoarseDisparity:
    """A first map. values: (H, W) at the size of the views. range_px: limits of the final map, in px per view step."""

    values: FloatImage
    range_px: tuple[float, float]


def estimate_coarse(views: Sequence[StoredColors], offsets: Sequence[ViewOffset], reference: int) -> CoarseDisparity:
    """A first map, and which disparities there are: all that shift no view by more than MOST_SHIFT_SHARE are tried.

    views: (H, W, 3) each, of equal size. offsets: their viewpoints, from any origin. reference: index of the view that
    the map is for. Raises InputError where there are fewer than two viewpoints or the views are too small.
    """
    size = image_size(views[reference])
    shrink = -(-max(size) // SMALL_SIDE_PX)
    if min(size) // shrink < LEAST_SIDE_PX:
        raise InputError(f"views of {size} are too small or too narrow to find their disparity: 8 px at least")
    small = _matching_views(views, offsets, reference, shrink)
    step = STEP_PX / small.reach
    most = MOST_SHIFT_SHARE * max(small.luma.shape) / small.reach
    disparities = np.arange(-most, most + step, step, dtype=np.float32)
    values, sureness = choose_disparity(sweep(small, disparities), small.luma, disparities)
    values = _median(values)
    is_sure = sureness >= SURE_MATCH
    if len(small.textures) <= FEW_VIEWS:
        is_sure &= _agrees(small, values, disparities)
    low, high = np.quantile(values[is_sure] if is_sure.any() else values, [RARE, 1 - RARE])
    margin = MARGIN_STEPS * step
    whole = resample_surfaces(np.clip(values, low, high) * np.float32(shrink), size)
    return CoarseDisparity(whole, (float(low - margin) * shrink, float(high + margin) * shrink))


def estimate_disparity(
    views: Sequence[StoredColors],
    offsets: Sequence[ViewOffset],
    reference: int,
    range_px: tuple[float, float],
) -> FloatImage:
    """The disparity (H, W) of the reference view, px per view step, within a range (px per view step).

    As `estimate_coarse` otherwise, which finds the range. A range of more than MOST_STEPS steps is swept more coarsely.
    """
    matched = _matching_views(views, offsets, reference, 1)
    disparities = np.linspace(*range_px, sweep_steps(range_px, matched.reach) + 1, dtype=np.float32)
    done, total = 0.0, map_work(len(disparities), len(matched.textures))

    def advance(work: float = 1.0) -> None:
        nonlocal done
        done += work
        report_progress(done, total, FINDING)

    values, _ = choose_disparity(sweep(matched, disparities, advance), matched.luma, disparities)
    advance(CHOOSING_WORK * len(disparities))
    values = _median(values)
    if len(matched.textures) <= FEW_VIEWS:
        is_seen = _agrees(matched, values, disparities, advance)
        values = _fill_unseen(views[reference], values, is_seen)
        advance(CHOOSING_WORK * len(disparities))
    return _refine(matched, values, range_px)


def refine_disparity(
    views: Sequence[StoredColors],
    offsets: Sequence[ViewOffset],
    reference: int,
    values: FloatImage,
    range_px: tuple[float, float],
) -> FloatImage:
    """The same from disparity (H, W) that is off by less than a pixel already: nothing is swept."""
    return _refine(_matching_views(views, offsets, reference, 1), values, range_px)


def map_work(steps: int, views: int) -> float:
    """What `estimate_disparity` takes with so many disparities and views, in steps of its sweep."""
    return (1 + (views <= FEW_VIEWS)) * steps * (1 + CHOOSING_WORK) + REFINING_WORK


def sweep_steps(range_px: tuple[float, float], reach: float) -> int:
    """How many steps of disparity are tried within a range, px per view step. reach: as `sweep_bytes` has it."""
    return int(np.clip(np.ceil((range_px[1] - range_px[0]) * reach / STEP_PX), 2, MOST_STEPS))


def sweep_bytes(size: tuple[int, int], range_px: tuple[float, float], reach: float) -> int:
    """Memory that `estimate_disparity` takes at most beside the views. reach: view steps to the farthest of them."""
    steps = min(max((range_px[1] - range_px[0]) * reach / STEP_PX, 2), MOST_STEPS) + 1
    costs_and_sums, textures_and_spare = 5 * steps, 4 * (33 + 24)
    return int(size[0] * size[1] * (costs_and_sums + textures_and_spare))


def _matching_views(
    views: Sequence[StoredColors],
    offsets: Sequence[ViewOffset],
    reference: int,
    shrink: int,
) -> MatchingViews:
    if len({(offset.t, offset.s) for offset in offsets}) < 2:
        raise InputError("all views have the same viewpoint, so no depth can be found")
    chosen = choose_views(list(offsets), reference)
    lumas = [luma_of(views[index], shrink) for index in chosen]
    return matching_views(lumas, [offsets[index] for index in chosen])


def _refine(matched: MatchingViews, values: FloatImage, range_px: tuple[float, float]) -> FloatImage:
    refined: FloatImage = np.clip(refine_by_gradients(matched, values), *range_px).astype(np.float32)
    return refined


def _agrees(
    views: MatchingViews,
    values: FloatImage,
    disparities: NDArray[np.float32],
    report_step: Callable[[], None] = lambda: None,
) -> NDArray[np.bool_]:
    """Where the farthest view, matched in its turn, gives a place the same disparity (H, W): what both of them see."""
    other = len(views.textures) - 1
    order = [other, *(index for index in range(other))]
    turned = MatchingViews(views.textures[order], views.offsets[order] - views.offsets[other], views.textures[other])
    seen, _ = choose_disparity(sweep(turned, disparities, report_step), turned.luma, disparities)
    seen = _median(seen)
    offsets = [ViewOffset(float(t), float(s)) for t, s in views.offsets[[0, other]]]
    return find_confirmed([values, seen], offsets, 0)


def _fill_unseen(colors: StoredColors, values: FloatImage, is_seen: NDArray[np.bool_]) -> FloatImage:
    """What one view alone sees takes the disparity of what looks like it around."""
    if not is_seen.any():
        return values
    known = np.where(is_seen, values, np.float32(np.nan))
    return fill_disparity_by_color(encoded_from_stored(colors), known)


def _median(values: FloatImage) -> FloatImage:
    """Of 5x5 pixels around each, so that no lone pixel stands out; cut at the borders."""
    result = np.empty_like(values)
    in_bands(lambda first, last: _medians(values, first, last, result), image_size(values))
    return result


@kernel
def _medians(values, first, last, result):
    height, width = values.shape
    ordered = np.empty(25, np.float32)
    for y in range(first, last):
        for x in range(width):
            count = 0
            for row in range(max(0, y - 2), min(height, y + 3)):
                for column in range(max(0, x - 2), min(width, x + 3)):
                    # Insertion: 25 values are few.
                    value, at = values[row, column], count
                    while at > 0 and ordered[at - 1] > value:
                        ordered[at] = ordered[at - 1]
                        at -= 1
                    ordered[at] = value
                    count += 1
            result[y, x] = ordered[count // 2]
