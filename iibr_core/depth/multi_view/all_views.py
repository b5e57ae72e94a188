"""Disparity of every view of a light field.

Matching a view takes far longer than all else, and a view between two matched views shows next to nothing that neither
of them shows. So every other view is matched, as on a chessboard; their maps are warped to the views between, and
refined there. At last all maps are compared. A map is least sure where few other views see a place: pixels that no
other map confirms, or that more maps contradict than confirm, are filled by similar colours around them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import chain
from math import hypot

import numpy as np

from iibr_core.color import encoded_from_stored
from iibr_core.depth.multi_view.estimate import estimate_disparity, find_confirmed
from iibr_core.depth.multi_view.matching import FINDING, matching_views
from iibr_core.depth.multi_view.refinement import refine_by_gradients
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.view import Renderer
from iibr_core.runtime.tiling import side_by_side
from iibr_core.runtime.work import part_of_job, report_progress
from iibr_core.types import FloatImage, StoredColors, ViewOffset, ViewUpdate, image_size


def estimate_all(
    views: Sequence[StoredColors], offsets: Sequence[ViewOffset], range_px: tuple[float, float]
) -> list[FloatImage]:
    """Return the disparity (H, W) of each view in a range, both in px per view step, in agreement with each other.

    views: (H, W, 3) each, of equal size. offsets: their viewpoints. `estimate_coarse` finds the range. Each view
    counts twice for progress: estimated, and compared with the others. Raises InputError if all views have the same
    viewpoint.
    """
    maps: dict[int, FloatImage] = {}
    total = 2 * len(views)
    matched = matched_views(offsets)
    for index in matched:
        with part_of_job(len(maps), 1, total):
            maps[index] = estimate_disparity(views, offsets, index, range_px)
    for index in sorted(set(range(len(views))) - set(matched)):
        warped = _warp({other: maps[other] for other in matched}, views, offsets, index)
        maps[index] = np.clip(refine_by_gradients(matching_views(views, offsets, index), warped), *range_px)
        report_progress(len(maps), total, FINDING)
    ordered = [maps[index] for index in range(len(views))]
    with part_of_job(len(views), len(views), total):
        return reconcile(views, ordered, offsets)


def matched_views(offsets: Sequence[ViewOffset]) -> list[int]:
    """Return the views to match: all but every second view that has others on both sides, in its row or column."""
    rows, columns = (sorted({offset[axis] for offset in offsets}) for axis in (0, 1))
    matched = []
    for index, (t, s) in enumerate(offsets):
        row, column = rows.index(t), columns.index(s)
        is_between = 0 < row < len(rows) - 1 or 0 < column < len(columns) - 1
        if (row + column) % 2 == 0 or not is_between:
            matched.append(index)
    return matched


def reconcile(
    views: Sequence[StoredColors], maps: Sequence[FloatImage], offsets: Sequence[ViewOffset]
) -> list[FloatImage]:
    """Return the maps, (H, W) each, with unconfirmed pixels filled; a map without confirmed pixels stays unchanged."""
    reconciled = []
    for index, (colors, values) in enumerate(zip(views, maps)):
        is_confirmed = find_confirmed(maps, offsets, index)
        if is_confirmed.any() and not is_confirmed.all():
            known = np.where(is_confirmed, values, np.float32(np.nan))
            values = fill_disparity_by_color(encoded_from_stored(colors), known)
        reconciled.append(values)
        report_progress(len(reconciled), len(maps), FINDING)
    return reconciled


def carry(
    values: FloatImage, reference: StoredColors, others: Iterator[tuple[ViewUpdate, ViewOffset]], farthest: float
) -> Iterator[ViewUpdate]:
    """Yield each of the other views with the disparity (H, W) that the map of the reference shows in it.

    others: with their viewpoints from the reference; farthest: largest distance of a viewpoint along an axis. Holes are
    filled by similar colours around them.
    """
    if (first := next(others, None)) is None:
        return
    rays = rays_of_photo(encoded_from_stored(reference), values, farthest, 0)

    def carry_to(other: tuple[ViewUpdate, ViewOffset]) -> ViewUpdate:
        update, offset = other
        view, _ = Renderer().visible(rays, offset)
        known = np.where(view.occluded, np.float32(np.nan), view.disparity)
        is_known = not np.isnan(known).all()
        filled = fill_disparity_by_color(encoded_from_stored(update.colors), known) if is_known else values
        return replace(update, disparity=filled)

    yield from side_by_side(carry_to, chain((first,), others))


def _warp(
    maps: dict[int, FloatImage], views: Sequence[StoredColors], offsets: Sequence[ViewOffset], index: int
) -> FloatImage:
    """Return the disparity (H, W) that maps of the nearest views show in this view, its holes filled by colour.

    If they show nothing at all, the nearest map is returned.
    """
    warped = np.full(image_size(views[index]), np.nan, np.float32)

    def away(other: int) -> ViewOffset:
        return ViewOffset(offsets[index].t - offsets[other].t, offsets[index].s - offsets[other].s)

    nearest = sorted(maps, key=lambda other: hypot(*away(other)))[:4]
    for other in nearest:
        rays = rays_of_photo(encoded_from_stored(views[other]), maps[other], max(map(abs, away(other))), 0)
        view, _ = Renderer().visible(rays, away(other))
        np.copyto(warped, view.disparity, where=np.isnan(warped) & ~view.occluded)
    if np.isnan(warped).all():
        return maps[nearest[0]]
    return fill_disparity_by_color(encoded_from_stored(views[index]), warped)
