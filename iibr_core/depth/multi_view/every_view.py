"""The disparity of every view of a light field.

Matching a view costs far more than all the rest, and what stands between two matched views shows next to nothing that
neither of them does. So every other view is matched, as on a chessboard; their maps are carried to those between, and
refined there. In the end all maps are held against each other.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import hypot

import numpy as np

from iibr_core.color import encoded_from_stored
from iibr_core.depth.multi_view.agreement import reconcile
from iibr_core.depth.multi_view.estimate_disparity import (
    FINDING,
    estimate_disparity,
    map_work,
    refine_disparity,
    sweep_steps,
)
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.view import Renderer
from iibr_core.runtime.work import part_of_job, report_progress
from iibr_core.types import (
    FloatImage,
    StoredColors,
    ViewOffset,
    image_size,
)

CARRIED_FROM = 4
"""So many maps at most, the nearest first, are carried to a view."""
STEP_WORK, RECONCILE_WORK = 0.04, 0.01
"""What a step of a sweep takes, and holding one map against another, where carrying maps to a view takes 1."""


def estimate_all(
    views: Sequence[StoredColors],
    offsets: Sequence[ViewOffset],
    range_px: tuple[float, float],
) -> list[FloatImage]:
    """The disparity (H, W) of each view, px per view step, within a range (`estimate_coarse` finds it), in agreement
    with the others.

    views: (H, W, 3) each, of equal size. offsets: their viewpoints. Raises InputError where these are all one.
    """
    maps: dict[int, FloatImage] = {}
    matching = {index: _matching_work(offsets, index, range_px) for index in matched_views(offsets)}
    between = set(range(len(views))) - set(matching)
    done, reconciling = 0.0, RECONCILE_WORK * len(views) ** 2
    total = sum(matching.values()) + len(between) + reconciling

    for index, work in matching.items():
        with part_of_job(done, work, total):
            maps[index] = estimate_disparity(views, offsets, index, range_px)
        done += work
    matched = dict(maps)
    for index in sorted(between):
        values = _carry(matched, views, offsets, index)
        maps[index] = refine_disparity(views, offsets, index, values, range_px)
        done += 1
        report_progress(done, total, FINDING)
    ordered = [maps[index] for index in range(len(views))]
    with part_of_job(done, reconciling, total):
        return reconcile(views, ordered, offsets)


def _matching_work(offsets: Sequence[ViewOffset], index: int, range_px: tuple[float, float]) -> float:
    """What matching a view takes."""
    reach = max(max(abs(at.t - offsets[index].t), abs(at.s - offsets[index].s)) for at in offsets)
    return STEP_WORK * map_work(sweep_steps(range_px, reach) + 1, len(offsets))


def matched_views(offsets: Sequence[ViewOffset]) -> list[int]:
    """Which views are matched: all but every second one that has others on both sides, in its row or in its column."""
    rows, columns = (sorted({offset[axis] for offset in offsets}) for axis in (0, 1))
    matched = []
    for index, (t, s) in enumerate(offsets):
        row, column = rows.index(t), columns.index(s)
        is_between = 0 < row < len(rows) - 1 or 0 < column < len(columns) - 1
        if (row + column) % 2 == 0 or not is_between:
            matched.append(index)
    return matched


def _carry(
    maps: dict[int, FloatImage],
    views: Sequence[StoredColors],
    offsets: Sequence[ViewOffset],
    index: int,
) -> FloatImage:
    """The disparity (H, W) that maps of other views show in this one; what none of them shows takes what looks like
    it around. Where they show nothing at all, the nearest map.
    """
    at, carried = offsets[index], np.full(image_size(views[index]), np.nan, np.float32)

    def away(other: int) -> ViewOffset:
        return ViewOffset(at.t - offsets[other].t, at.s - offsets[other].s)

    nearest = sorted(maps, key=lambda other: hypot(*away(other)))[:CARRIED_FROM]
    for other in nearest:
        rays = rays_of_photo(encoded_from_stored(views[other]), maps[other], max(map(abs, away(other))), 0)
        seen, _ = Renderer().visible(rays, away(other))
        np.copyto(carried, seen.disparity, where=np.isnan(carried) & ~seen.occluded)
    if np.isnan(carried).all():
        return maps[nearest[0]]
    return fill_disparity_by_color(encoded_from_stored(views[index]), carried)
