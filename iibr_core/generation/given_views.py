"""The views of a light field on disk as `densify` takes them: with their disparity, found where the files lack it."""

from __future__ import annotations

import math
from dataclasses import replace

from iibr_core.depth.multi_view.estimate_disparity import estimate_coarse, sweep_bytes
from iibr_core.depth.multi_view.every_view import estimate_all
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.light_fields.views import grid_of, read_views
from iibr_core.generation.dense_field import GivenView
from iibr_core.generation.memory import require_memory
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.types import GridShape, ReportProgress, ViewUpdate, ignore_progress

VIEW_BYTES = 60
"""Of a pixel of each view: its colours, its disparity, and two images of rays."""
READ_WORK, NEW_VIEW_WORK = 0.05, 0.3
"""What reading a view takes, and making a new one, where finding disparity by carrying that of others takes 1."""


class DenseFieldWork:
    """Work on a field with views between given ones: done, and in all (0 where that is not known yet)."""

    def __init__(self, given: GridShape, dense: GridShape) -> None:
        self._making = NEW_VIEW_WORK * (dense.rows * dense.columns - given.rows * given.columns)
        self._reading = 0.0

    def reading(self, done: float, total: float) -> tuple[float, float]:
        """While `read_given_views` reports this."""
        self._reading = max(done, total)
        return done, total + self._making if total else 0.0

    def making(self, share: float) -> tuple[float, float]:
        """With this share of `densify`'s work done."""
        return self._reading + share * self._making, self._reading + self._making


def read_given_views(
    scene: MultiView,
    report_progress: ReportProgress = ignore_progress,
) -> list[GivenView]:
    """All views of a light field whose views fill a grid. report_progress: of work, see `NEW_VIEW_WORK`.

    Raises InputError where a file cannot be read, no disparity can be found or memory does not suffice.
    """
    grid, (size, views) = grid_of(scene), read_views(scene)
    what = f"making views between {grid.columns} x {grid.rows} of {scene.name} ({size})"
    require_memory(math.prod(size) * math.prod(grid) * VIEW_BYTES, what)
    read: list[ViewUpdate] = []
    for view in views:
        raise_if_stopped()
        read.append(view)
        report_progress(READ_WORK * len(read), 0, "reading")
    if any(view.disparity is None for view in read):
        colors, offsets = [view.colors for view in read], [grid.offset(view.row, view.column) for view in read]
        # The centre comes first.
        range_px = estimate_coarse(colors, offsets, 0).range_px
        require_memory(sweep_bytes(size, range_px, float(max(grid) - 1)), f"{scene.name}: finding its disparity")
        before = READ_WORK * len(read)

        def report(done: float, total: float, doing: str) -> None:
            report_progress(before + done, before + total, doing)

        maps = estimate_all(colors, offsets, range_px, report)
        read = [replace(view, disparity=values) for view, values in zip(read, maps)]
    return [
        GivenView(view.row, view.column, view.colors, view.disparity) for view in read if view.disparity is not None
    ]
