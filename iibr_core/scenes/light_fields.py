"""A light field from disk for display: as read, and once more with disparity if its views have none, so that
focusing, wide apertures and viewpoints between the views work as with a photo; or with views made between its own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from iibr_core.color import encoded_from_stored
from iibr_core.depth.subject import subject_disparity
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.generation.memory import require_memory, view_bytes
from iibr_core.scenes.dense import read_dense
from iibr_core.scenes.opening_work import MeasureViews, OpeningWork, ViewsWork
from iibr_core.scenes.scene import Progress, Scene, Source
from iibr_core.types import (
    FloatImage,
    GridShape,
    ImageSize,
    InputError,
    ReportProgress,
    ViewOffset,
    ViewUpdate,
    ignore_progress,
    image_size,
)

if TYPE_CHECKING:
    from iibr_core.formats.light_fields.multi_view_scene import MultiView

UNKNOWN_DISPARITY_RANGE_PX = (-4.0, 4.0)
"""Range of the focus, in px per view step, in a light field without disparity."""
FROM_VIEWS = "the views themselves"


@dataclass(frozen=True, eq=False)
class Showing:
    """A light field for display. views: all views, the centre first. measure: returns the progress after some views."""

    scene: Scene
    views: Iterator[ViewUpdate]
    measure: MeasureViews


def showings_of_light_field(
    source: Source,
    report_progress: Callable[[Progress], None],
    takes_drafts: bool,
    known: FloatImage | None = None,
    nearest_to: Callable[[], ViewOffset] = lambda: ViewOffset(0.0, 0.0),
) -> Iterator[Showing]:
    """The light field of a folder or file, whatever its layout; on a denser grid than its own where the source asks for
    one, once, views nearest to `nearest_to()` first.

    takes_drafts: views without disparity are shown as read, then with a coarse one, then with the final one; else the
    field is shown once, when all is known. known: disparity of the centre view that was found before. The views of a
    showing must be taken before the next is asked for. Raises InputError for a field or a map that cannot be read.
    """
    from iibr_core.formats.light_fields.views import disparity_range, grid_of, read_views

    field = open_light_field(Path(source.path))
    grid, (size, views) = grid_of(field), read_views(field)
    _require_field(field.name, size, source.filled_grid or grid)
    if source.filled_grid is not None and source.filled_grid != grid:
        yield _filled_between(source, field, report_progress, nearest_to)
        return
    given = known if source.depth.file is None else _read_map(source, size)
    read: list[ViewUpdate] = [next(views)]
    scene = _scene_as_read(source, field, grid, read[0], disparity_range(field))
    is_whole = (scene.has_view_disparity and given is None) or max(grid) == 1
    finds = given is None and read[0].disparity is None
    work = OpeningWork(grid.rows * grid.columns, finds and not is_whole, takes_drafts, carries=not is_whole)
    if is_whole:
        yield Showing(scene, chain(read, views), work.measuring("reading"))
        return
    if takes_drafts:
        yield Showing(scene, (replace(view, is_final=False) for view in _keep(read, views)), work.measuring("reading"))
    else:
        for view in views:
            read.append(view)
            report_progress(work.advance("reading", view.share))
    found = _Field(scene, grid, read, work)
    yield from _with_disparity(found, given, report_progress, takes_drafts)


def _filled_between(
    source: Source,
    field: MultiView,
    report_progress: Callable[[Progress], None],
    nearest_to: Callable[[], ViewOffset],
) -> Showing:
    """The field with views made between its own, from all of them."""
    from iibr_core.formats.light_fields.views import grid_of

    if source.depth.file is not None:
        raise InputError(
            f"{source.depth.file}: is the disparity of one view, and views between take that of all: open"
            f" {field.name} without it"
        )
    wanted = source.filled_grid
    assert wanted is not None
    opening = ViewsWork(math.prod(wanted))

    def report(done: float, total: float, doing: str) -> None:
        report_progress(opening.advance((done, total), doing=doing))

    dense = read_dense(field, wanted, source.inpaint, report, nearest_to)
    low, high = min(view.disparity.min() for view in dense.given), max(view.disparity.max() for view in dense.given)
    middle, steps = dense.given[0], dense.steps
    centre = ViewUpdate(middle.row, middle.column, middle.colors, middle.disparity / np.float32(steps))
    scene = replace(
        _scene_as_read(source, field, grid_of(field), centre, (float(low) / steps, float(high) / steps)),
        grid=wanted,
        depth_source="light field" if len(field.disparity) == len(field.views) else FROM_VIEWS,
        has_view_disparity=True,
    )
    work = dense.work
    return Showing(scene, dense.views, lambda there, drafts, share: opening.advance(work.making(share), there, drafts))


def find_disparity(field: MultiView, report_progress: ReportProgress = ignore_progress) -> FloatImage:
    """Disparity (H, W) of the centre view, of a pair the left one, from all views: px per view step.

    Raises InputError, also where memory does not suffice.
    """
    from iibr_core.depth.multi_view.estimate_disparity import FINDING, estimate_coarse, estimate_disparity
    from iibr_core.formats.light_fields.views import grid_of, read_views

    grid, (size, views) = grid_of(field), read_views(field)
    _require_field(field.name, size, grid)
    # Of a pair it is the left one's.
    read = sorted(views, key=lambda view: (view.row, view.column) != field.views[field.centre].place)
    colors, offsets = [view.colors for view in read], [grid.offset(view.row, view.column) for view in read]
    report_progress(0, 0, FINDING)
    coarse = estimate_coarse(colors, offsets, 0)
    _require_matching(field.name, size, coarse.range_px, offsets)
    return estimate_disparity(colors, offsets, 0, coarse.range_px, report_progress=report_progress)


def _require_field(name: str, size: ImageSize, grid: GridShape) -> None:
    """Raise InputError where so many views of this (height, width) do not fit into memory."""
    needed = view_bytes(math.prod(size) * math.prod(grid), is_hdr=False)
    require_memory(needed, f"{name}: {grid.columns} x {grid.rows} views of {size}")


def _require_matching(name: str, size: ImageSize, range_px: tuple[float, float], offsets: Sequence[ViewOffset]) -> None:
    """Raise InputError where finding the disparity of the first of these views, between these two, takes too much."""
    from iibr_core.depth.multi_view.estimate_disparity import sweep_bytes

    at = offsets[0]
    reach = max(max(abs(offset.t - at.t), abs(offset.s - at.s)) for offset in offsets)
    require_memory(sweep_bytes(size, range_px, reach), f"{name}: finding its disparity")


@dataclass(frozen=True, eq=False)
class _Field:
    """A light field as read. views: the centre first. work: of opening it."""

    scene: Scene
    grid: GridShape
    views: list[ViewUpdate]
    work: OpeningWork

    def showing(self, values: FloatImage, origin: str, is_final: bool, range_px: tuple[float, float]) -> Showing:
        """The same with the disparity of its centre view, carried to the others."""
        scene = replace(
            self.scene,
            disparity_range_px=range_px,
            depth_source=origin,
            has_view_disparity=True,
            subject_disparity_px=subject_disparity(values),
        )
        views = self._views_with(values, is_final)
        return Showing(scene, views, self.work.measuring("carrying" if is_final else "drafting"))

    def _views_with(self, values: FloatImage, is_final: bool) -> Iterator[ViewUpdate]:
        from iibr_core.generation.carried_disparity import carry_disparity

        colors = {(view.row, view.column): view.colors for view in self.views}
        centre = encoded_from_stored(self.views[0].colors)
        for made in carry_disparity(centre, values, self.grid):
            yield replace(made, colors=colors[made.row, made.column], inpainted=None, is_final=is_final)


def _with_disparity(
    field: _Field,
    given: FloatImage | None,
    report_progress: Callable[[Progress], None],
    takes_drafts: bool,
) -> Iterator[Showing]:
    """The field with the given disparity of its centre view, with the one it came with, or one found from its views."""
    from iibr_core.depth.multi_view.estimate_disparity import estimate_coarse, estimate_disparity

    if given is not None:
        file = field.scene.source.depth.file
        yield field.showing(given, Path(file).name if file else FROM_VIEWS, True, _range_of(given))
        return
    own = field.views[0].disparity
    if own is not None:
        yield field.showing(own, field.scene.depth_source, True, _range_of(own))
        return
    colors = [view.colors for view in field.views]
    offsets = [field.grid.offset(view.row, view.column) for view in field.views]
    report_progress(field.work.advance("searching", 0.0))
    try:
        coarse = estimate_coarse(colors, offsets, 0)
        _require_matching(field.scene.name, image_size(coarse.values), coarse.range_px, offsets)
    except InputError as error:
        # The views can be looked at without.
        scene = replace(field.scene, notes=(*field.scene.notes, f"{error}."), problems=(f"{error}.",))
        yield Showing(scene, (replace(view, share=1.0) for view in field.views), field.work.measuring("carrying"))
        return
    field.work.knows_search(coarse.times_dearer)
    if takes_drafts:
        yield field.showing(coarse.values, FROM_VIEWS, False, _range_of(coarse.values))

    def report(done: float, total: float, doing: str) -> None:
        report_progress(field.work.advance("matching", done / total))

    report(0.0, 1.0, "")
    values = estimate_disparity(colors, offsets, 0, coarse.range_px, report)
    yield field.showing(values, FROM_VIEWS, True, _range_of(values))


def _scene_as_read(
    source: Source, field: MultiView, grid: GridShape, centre: ViewUpdate, range_px: tuple[float, float] | None
) -> Scene:
    height, width = centre.colors.shape[:2]
    return Scene(
        source=source,
        name=field.name,
        width=width,
        height=height,
        grid=grid,
        disparity_range_px=range_px or UNKNOWN_DISPARITY_RANGE_PX,
        depth_source="light field" if centre.disparity is not None else "none",
        is_hdr=field.is_hdr,
        notes=field.notes,
        has_view_disparity=len(field.disparity) == len(field.views),
        subject_disparity_px=subject_disparity(centre.disparity) if centre.disparity is not None else 0.0,
        given_grid=grid,
    )


def _read_map(source: Source, size: ImageSize) -> FloatImage:
    """The map that the user named, as the disparity of the centre view."""
    from iibr_core.formats.maps.disparity_file import read_disparity

    assert source.depth.file is not None
    return read_disparity(Path(source.depth.file), size, source.depth.file_scale or 1.0).values


def _keep(read: list[ViewUpdate], views: Iterator[ViewUpdate]) -> Iterator[ViewUpdate]:
    """All views, those still to come kept as well. They come again, with disparity."""
    yield replace(read[0], is_final=False)
    for view in views:
        read.append(view)
        yield replace(view, is_final=False)


def _range_of(values: FloatImage) -> tuple[float, float]:
    return float(values.min()), float(values.max())
