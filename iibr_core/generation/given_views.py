"""The views of a light field on disk as `densify` takes them: with their disparity, found where the files lack it."""

from __future__ import annotations

from dataclasses import replace

from iibr_core.depth.multi_view.estimate import estimate_coarse, sweep_bytes
from iibr_core.depth.multi_view.every_view import estimate_all
from iibr_core.formats.light_fields.scene import MultiView
from iibr_core.formats.light_fields.views import grid_of, read_views
from iibr_core.generation.dense_field import GivenView
from iibr_core.generation.memory_model import WRITER_BYTES, Budget, require_dense_field
from iibr_core.runtime.tiling import ShouldStop, never, raise_if_stopped
from iibr_core.types import ReportProgress, ViewUpdate, ignore_progress


def read_given_views(
    scene: MultiView,
    budget: Budget,
    should_stop: ShouldStop = never,
    report_progress: ReportProgress = ignore_progress,
) -> list[GivenView]:
    """All views of a light field whose views fill a grid.

    Raises InputError where a file cannot be read, no disparity can be found or memory does not suffice, Cancelled once
    should_stop is true.
    """
    grid, (size, views) = grid_of(scene), read_views(scene)
    require_dense_field(budget, scene.name, size, grid)
    read: list[ViewUpdate] = []
    for view in views:
        raise_if_stopped(should_stop)
        report_progress(len(read), len(scene.views), "reading")
        read.append(view)
    if any(view.disparity is None for view in read):
        colors, offsets = [view.colors for view in read], [grid.offset(view.row, view.column) for view in read]
        # The centre comes first.
        range_px = estimate_coarse(colors, offsets, 0, should_stop).range_px
        needed = WRITER_BYTES + sweep_bytes(size, range_px, float(max(grid) - 1))
        budget.require(needed, f"{scene.name}: finding its disparity", "raise --memory")
        maps = estimate_all(colors, offsets, range_px, should_stop, report_progress)
        read = [replace(view, disparity=values) for view, values in zip(read, maps)]
    return [
        GivenView(view.row, view.column, view.colors, view.disparity) for view in read if view.disparity is not None
    ]
