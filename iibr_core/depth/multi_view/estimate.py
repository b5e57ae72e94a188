"""Disparity of one view of a light field, or of a pair, from all views: first of a small copy, to find its range."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from iibr_core.depth.multi_view.matching import FINDING, STEP_PX, MatchingViews, matching_views, sweep
from iibr_core.depth.multi_view.plain_areas import find_stripes, lean_stripes, move_plain_areas_back
from iibr_core.depth.multi_view.refinement import refine_by_gradients
from iibr_core.depth.multi_view.semi_global import choose_disparity
from iibr_core.formats.maps.resample import resample_surfaces
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.runtime.work import ignore_progress, part_of_job, raise_if_stopped, report_progress, watched
from iibr_core.types import FloatImage, ImageSize, InputError, StoredColors, ViewOffset, image_size

SMALL_SIDE_PX = 160
"""Longer side of the small copy."""
MAX_STEPS = 512
"""Largest number of disparities of a sweep; a wider range is swept more coarsely."""
FEW_VIEWS_STEP = 2 / 3
"""Share of the usual number of disparities that few views are matched at."""
MIN_SURENESS = 0.4
"""Least sureness of a surface that others are compared with."""
FEW_VIEWS = 4
"""Number of views up to which many places match by chance, so that maps are checked against each other."""


@dataclass(frozen=True, eq=False)
class CoarseDisparity:
    """A coarse map. values: (H, W) at the size of the views. range_px: limits of the final map, in px per view step."""

    values: FloatImage
    range_px: tuple[float, float]


def estimate_coarse(views: Sequence[StoredColors], offsets: Sequence[ViewOffset], reference: int) -> CoarseDisparity:
    """Return a coarse map of the reference view, and the range of its disparity.

    views: (H, W, 3) each, of equal size. offsets: their viewpoints, from any origin. reference: an index. Reports no
    progress. Raises InputError if all views have the same viewpoint or are too small.
    """
    small, shrink, disparities = _small_copy(views, offsets, reference)
    size, step = image_size(views[reference]), float(disparities[1] - disparities[0])
    with watched(ignore_progress):
        matched = _match(small, disparities)
        values, is_sure = matched.values, (matched.sureness >= MIN_SURENESS) & ~matched.is_plain
        if len(views) <= FEW_VIEWS:
            is_sure &= left_right_check(views, offsets, reference, values, disparities, shrink)
    # A few sure pixels at either end may be mistaken, and a few steps beyond them may be needed.
    low, high = np.quantile(values[is_sure] if is_sure.any() else values, [0.002, 0.998])
    margin = 4 * step
    whole = resample_surfaces(np.clip(values, low, high) * np.float32(shrink), size)
    return CoarseDisparity(whole, (float(low - margin) * shrink, float(high + margin) * shrink))


def _small_copy(
    views: Sequence[StoredColors], offsets: Sequence[ViewOffset], reference: int
) -> tuple[MatchingViews, int, NDArray[np.float32]]:
    """Return views that are a whole number of times smaller, that number, and all disparities to try, in their px."""
    size = image_size(views[reference])
    shrink = -(-max(size) // SMALL_SIDE_PX)
    if min(size) // shrink < 8:
        raise InputError(f"views of {size} are too small or too narrow to find their disparity: 8 px at least")
    small = matching_views(views, offsets, reference, shrink)
    step = STEP_PX / small.reach
    # The farthest view may be shifted by 0.4 of the longer side.
    largest = 0.4 * max(small.luma.shape) / small.reach
    return small, shrink, np.arange(-largest, largest + step, step, dtype=np.float32)


def estimate_disparity(
    views: Sequence[StoredColors], offsets: Sequence[ViewOffset], reference: int, range_px: tuple[float, float]
) -> FloatImage:
    """Return the disparity (H, W) of the reference view in a range, both in px per view step.

    Arguments and errors are those of `estimate_coarse`, which finds the range.
    """
    return _estimate(views, offsets, reference, range_px)[0]


def estimate_with_doubt(
    views: Sequence[StoredColors], offsets: Sequence[ViewOffset], reference: int, range_px: tuple[float, float]
) -> tuple[FloatImage, NDArray[np.bool_]]:
    """Return the same, and where it is in doubt (H, W): in plain and in striped areas, which match anywhere."""
    values, is_doubtful = _estimate(views, offsets, reference, range_px)
    # What repeats itself may do so outside of the range.
    small, _, disparities = _small_copy(views, offsets, reference)
    with watched(ignore_progress):
        repeats = find_stripes(sweep(small, disparities))[0].astype(np.float32)
    return values, is_doubtful | (resample_surfaces(repeats, image_size(values)) > 0.5)


def _estimate(
    views: Sequence[StoredColors], offsets: Sequence[ViewOffset], reference: int, range_px: tuple[float, float]
) -> tuple[FloatImage, NDArray[np.bool_]]:
    """Return the disparity (H, W), and where it is in doubt by the range alone."""
    matched = matching_views(views, offsets, reference)
    is_checked = len(views) <= FEW_VIEWS
    steps = _steps(range_px, matched.reach * (FEW_VIEWS_STEP if is_checked else 1))
    disparities = np.linspace(*range_px, steps + 1, dtype=np.float32)
    # The last part is refinement.
    parts = 2 + is_checked
    with part_of_job(0, 1, parts):
        found = _match(matched, disparities)
        values = found.values
    if is_checked:
        with part_of_job(1, 1, parts):
            is_seen = found.is_plain | left_right_check(views, offsets, reference, values, disparities)
        if is_seen.any():
            values = fill_disparity_by_color(matched.colors, np.where(is_seen, values, np.float32(np.nan)))
    refined = np.clip(refine_by_gradients(matched, values), *range_px)
    report_progress(parts, parts, FINDING)
    return refined, found.is_plain | found.is_striped


def left_right_check(
    views: Sequence[StoredColors],
    offsets: Sequence[ViewOffset],
    reference: int,
    values: FloatImage,
    disparities: NDArray[np.float32],
    shrink: int = 1,
) -> NDArray[np.bool_]:
    """Return which pixels (H, W) of the reference's map the map of the farthest view confirms: both views see them."""
    at = offsets[reference]
    farthest = max(range(len(views)), key=lambda index: np.hypot(offsets[index].t - at.t, offsets[index].s - at.s))
    other = _match(matching_views(views, offsets, farthest, shrink), disparities).values
    return find_confirmed([values, other], [at, offsets[farthest]], 0)


def find_confirmed(maps: Sequence[FloatImage], offsets: Sequence[ViewOffset], index: int) -> NDArray[np.bool_]:
    """Return which pixels (H, W) of one of the maps the other maps confirm.

    At least one map must have the same point, to a pixel of its view, and no fewer maps than look through it, to
    something behind. A map with something in front of the point does not count.
    """
    values = maps[index]
    rows, columns = np.indices(values.shape, np.float32)
    agreeing, behind = np.zeros(values.shape, np.int32), np.zeros(values.shape, np.int32)
    for other, offset in zip(maps, offsets):
        t, s = offset.t - offsets[index].t, offset.s - offsets[index].s
        if t == s == 0:
            continue
        raise_if_stopped()
        nearer = _sample(other, rows - values * np.float32(t), columns - values * np.float32(s)) - values
        largest = np.float32(1 / max(abs(t), abs(s)))
        agreeing += np.abs(nearer) <= largest
        behind += nearer < -largest
    confirmed: NDArray[np.bool_] = (agreeing > 0) & (agreeing >= behind)
    return confirmed


def sweep_bytes(size: ImageSize, range_px: tuple[float, float], reach: float) -> int:
    """Return the memory that `estimate_disparity` takes beside the views. reach: view steps to the farthest view."""
    costs_and_sums, textures_and_spare = 6 * (_steps(range_px, reach) + 1), 4 * (33 + 32)
    return size.height * size.width * (costs_and_sums + textures_and_spare)


def _steps(range_px: tuple[float, float], reach: float) -> int:
    """Return the number of steps of a sweep of this range."""
    return int(np.clip(np.ceil((range_px[1] - range_px[0]) * reach / STEP_PX), 2, MAX_STEPS))


class _Match(NamedTuple):
    """Disparity and sureness (H, W), and which pixels belong to plain and to striped areas."""

    values: FloatImage
    sureness: FloatImage
    is_plain: NDArray[np.bool_]
    is_striped: NDArray[np.bool_]


def _match(views: MatchingViews, disparities: NDArray[np.float32]) -> _Match:
    """Match every pixel; a median smooths single pixels away."""
    costs = sweep(views, disparities)
    is_striped, limits = find_stripes(costs)
    if is_striped.any():
        # First without the costs of stripes: the surfaces around them reach across. 0 decides at equal distance.
        blank = np.where(is_striped[..., None], np.uint8(0), costs)
        near = choose_disparity(blank, views.colors, disparities, is_striped)[0] * (not is_striped.all())
        margin = 2 * (disparities[1] - disparities[0])
        lean_stripes(costs, is_striped, limits, disparities, near - np.clip(near, -margin, margin))
    values, sureness = choose_disparity(costs, views.colors, disparities, is_striped)
    is_plain = move_plain_areas_back(costs, views.colors, disparities, values, len(views.textures))
    image = oiio.ImageBuf(np.ascontiguousarray(values[..., None]))
    side = 5 if len(views.textures) <= FEW_VIEWS else 3
    median = oiio.ImageBufAlgo.median_filter(image, side, side).get_pixels(oiio.FLOAT)
    smooth = np.asarray(median, np.float32).reshape(values.shape)
    return _Match(smooth, sureness, is_plain, is_striped)


def _sample(image: FloatImage, row: FloatImage, column: FloatImage) -> FloatImage:
    """Return the nearest pixels of an image (H, W) at these positions, NaN outside."""
    height, width = image.shape
    y, x = np.rint(row), np.rint(column)
    is_inside = (y >= 0) & (y < height) & (x >= 0) & (x < width)
    y, x = (np.where(is_inside, at, 0).astype(np.int64) for at in (y, x))
    sampled: FloatImage = np.where(is_inside, image[y, x], np.float32(np.nan))
    return sampled
