"""A light field from disk for display: as read, and again with disparity if its views have none, so that focusing,
wide apertures and viewpoints between the views work as with a photo; or with views made between its own.
"""

import math
from collections.abc import Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

from iibr_core.beyond.between_views import densify, read_given_views, require_steps
from iibr_core.depth.multi_view.all_views import carry
from iibr_core.depth.multi_view.estimate import estimate_coarse
from iibr_core.depth.multi_view.matching import FINDING
from iibr_core.depth.multi_view.reduced import estimate_within_memory
from iibr_core.depth.multi_view.settle import Settled, confirm, settle
from iibr_core.depth.stereo_pair import MATCHED_PIXELS
from iibr_core.depth.subject import subject_disparity
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.multi_view_scene import (
    GridIndex,
    MultiView,
    common_size,
    grid_of_every,
    thinned,
)
from iibr_core.formats.light_fields.order import UNKNOWN, arranged, as_given, grid_of, numbers_of, step_length
from iibr_core.formats.light_fields.pair_files import TWO_FILES
from iibr_core.formats.light_fields.views import (
    disparity_range,
    in_order_of,
    offsets_by_place,
    read_views,
    row_step_of,
    view_offsets,
)
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.inpainting.registry import load_inpainter
from iibr_core.method.memory import budget_bytes, require_memory, view_bytes
from iibr_core.runtime.work import Cancelled, report_progress
from iibr_core.scenes.found_disparity import FoundDisparity, key_of_field, load_found, store_found
from iibr_core.scenes.scene import READING, Scene, Source
from iibr_core.types import (
    FloatImage,
    GridShape,
    ImageSize,
    InputError,
    ViewOffset,
    ViewUpdate,
    Wanted,
    image_size,
)

UNKNOWN_DISPARITY_RANGE_PX = (-4.0, 4.0)
"""Range of the focus in a light field without disparity, in pixels per view step."""
MAX_PIXELS, MAX_VIEWS = 350_000_000, 2048
"""Largest number of pixels of all views, and of views, that graphics cards hold with ease."""
FROM_VIEWS = "the views themselves"


@dataclass(frozen=True, eq=False)
class LoadedField:
    """A light field for display.

    views: all its views, the centre first; they are not final if the field comes again with better disparity.
    """

    scene: Scene
    views: Iterator[ViewUpdate]


def load_light_field(
    source: Source, takes_drafts: bool, known: FloatImage | None = None, wanted: Wanted = lambda: None
) -> Iterator[LoadedField]:
    """Yield the light field of a folder or file, again each time its disparity is known better.

    takes_drafts: views without disparity come as read, then with a coarse disparity, then with the final one; otherwise
    the field comes once, when all is known. known: disparity of the centre view that was found before. wanted: called
    after the centre view of a field with disparity was taken; only these views come. The views of a field must be taken
    before the next field is asked for.
    """
    field = open_field(source)
    given, map_file = known, source.depth.file
    is_found = given is None and map_file is None and not field.disparity and len(field.views) > 1
    key = key_of_field(field, source.arrangement) if is_found else ""
    found = load_found(key) if is_found else None
    if found is not None and found.arrangement != UNKNOWN:
        field = arranged(field, found.arrangement)
    wanted = (
        wanted if len(field.views) == math.prod(grid_of(field)) else lambda: None
    )  # a star's views stand for others
    grid = grid_of(field)
    is_centre_known = any(field.views[index].place == grid.centre for index in field.disparity)
    reads_all = found is None and given is None and map_file is None and not is_centre_known
    size, views = read_views(field, (lambda: None) if reads_all else wanted)
    _require_field(field.name, size, grid)
    if map_file is not None:
        given = read_disparity(Path(map_file), size, source.depth.file_scale or 1.0).values
    centre = next(views)
    scene = _scene_as_read(source, field, centre, disparity_range(field))
    if (scene.has_view_disparity and given is None) or max(grid) == 1:
        yield LoadedField(scene, chain((centre,), views))
        return
    if found is not None and found.values.shape == size:
        scene = replace(scene, arrangement=found.arrangement, notes=found.notes)
        yield _with_disparity(scene, chain((centre,), views), offsets_by_place(field), found.values, wanted)
        return
    read: list[ViewUpdate] = []
    if takes_drafts:
        yield LoadedField(scene, _keep(chain((centre,), views), read))
    else:
        for view in chain((centre,), views):
            read.append(view)
            report_progress(len(read), len(field.views), READING)
    if given is None and centre.disparity is None:
        yield from _with_found_disparity(scene, field, read, takes_drafts, wanted, key)
        return
    origin = scene.depth_source if given is None else Path(map_file).name if map_file else FROM_VIEWS
    values = centre.disparity if given is None else given
    assert values is not None
    yield _with_disparity(scene, read, offsets_by_place(field), values, wanted, origin)


def open_field(source: Source) -> MultiView:
    """Return the light field of a source, in the order that is known of it."""
    return _in_known_order(_opened(source), source)


def _opened(source: Source) -> MultiView:
    """Return the light field of a source: every n-th row and column where the user asks for them or more do not fit."""
    field, given = open_light_field(Path(source.path), source.arrangement), source.arrangement.grid
    if field.grid is None or (given is not None and math.prod(given) == len(field.views)):
        return field
    steps = range(1, max(field.grid) + 1)
    if given is not None:
        every = next((n for n in steps if grid_of_every(field.grid, n) == given), 1)
    else:
        pixels, room = math.prod(common_size(field.views[:1])), min(MAX_PIXELS, budget_bytes() // view_bytes(1, False))
        grids = {n: math.prod(grid_of_every(field.grid, n)) for n in steps}
        every = next((n for n in steps if grids[n] * pixels <= room and grids[n] <= MAX_VIEWS), 1)
    return thinned(field, every)


def _in_known_order(field: MultiView, source: Source) -> MultiView:
    given, is_final = source.arrangement, is_order_known(field, source) or source.depth.file
    return arranged(field, as_given(field, given)) if given != UNKNOWN and is_final and numbers_of(field) else field


def is_order_known(field: MultiView, source: Source) -> bool:
    """Return whether the order of a light field's views needs no test: names, files or the user are sure of it."""
    return bool(source.arrangement.is_complete or field.disparity or not field.numbers or len(field.views) == 1)


def open_settled(source: Source) -> tuple[MultiView, tuple[str, ...]]:
    """Return a light field in its right order, found from its views where it is not known, and notes."""
    field = _opened(source)
    if is_order_known(field, source):
        return _in_known_order(field, source), field.notes
    settled = settle(field, _read_all(field), source.arrangement)
    return settled.field, settled.notes


def find_disparity(source: Source) -> tuple[str, FloatImage, tuple[str, ...]]:
    """Return the name of a light field, the disparity (H, W) of its centre view in pixels per view step, and notes.

    Of a pair it is that of the left view.
    """
    field = _opened(source)
    read = _read_all(field)
    report_progress(0, 0, FINDING)
    settled, values, note = _with_disparity_of(settle(field, read, source.arrangement, is_left=True))
    return field.name, values, (*settled.notes, *note)


def find_range(source: Source) -> tuple[float, float] | None:
    """Return about the least and greatest disparity, in pixels per view step; None if none can be found."""
    field = open_field(source)
    with suppress(InputError):
        views = [view.colors for view in in_order_of(field, _read_all(field))]
        values = estimate_coarse(views, view_offsets(field), field.centre).values
        return float(values.min()), float(values.max())
    return None


def _read_all(field: MultiView) -> list[ViewUpdate]:
    grid, (size, views) = grid_of(field), read_views(field)
    _require_field(field.name, size, grid)
    return list(views)


def _with_disparity_of(settled: Settled) -> tuple[Settled, FloatImage, tuple[str, ...]]:
    """Return a light field, which may prove to be seen from behind, the disparity (H, W) of its centre, and notes."""
    colors, is_pair = [view.colors for view in settled.views], len(settled.views) == 2
    is_photo = settled.field.layout == TWO_FILES or settled.field.place.is_file()
    max_pixels = MATCHED_PIXELS if is_pair and is_photo else None
    values, notes = estimate_within_memory(colors, settled.offsets, 0, settled.coarse.range_px, max_pixels)
    confirmed = confirm(settled, values)
    if confirmed.arrangement != settled.arrangement:
        return _with_disparity_of(confirmed)
    return confirmed, values, notes


def read_dense(
    field: MultiView, grid: GridShape, inpaint: str
) -> tuple[Sequence[ViewUpdate], int, Generator[ViewUpdate]]:
    """Read the views of a light field, and begin to make views between them.

    Return its own views, the middle one first; the number of steps from one of them to the next; and all views.
    """
    sparse = grid_of(field)
    steps, inpainter = require_steps(sparse, grid, field.name), load_inpainter(inpaint)
    given = read_given_views(field)
    return given, steps, densify(given, sparse, grid, inpainter, row_step=row_step_of(field))


def _with_found_disparity(
    scene: Scene, field: MultiView, views: Sequence[ViewUpdate], takes_drafts: bool, wanted: Wanted, key: str
) -> Iterator[LoadedField]:
    """Yield the field with disparity found from its views, in the order that they show.

    It comes without disparity, and with a note, if no order fits or the views are too small. key: name under which the
    disparity is kept.
    """
    report_progress(0, 0, FINDING)
    try:
        settled = settle(field, views, scene.source.arrangement)
    except InputError as error:
        if field.is_guess:
            raise
        yield LoadedField(_with_problem(scene, error), iter(views))
        return
    if takes_drafts:
        draft = _settled_scene(scene, settled)
        yield _with_disparity(
            draft, settled.views, _offsets_of(settled), settled.coarse.values, lambda: None, is_final=False
        )
    settled, values, note = _with_disparity_of(settled)
    final = _settled_scene(scene, settled)
    final = replace(final, notes=(*final.notes, *note))
    if key:
        store_found(key, FoundDisparity(values, settled.arrangement, final.notes))
    yield _with_disparity(final, settled.views, _offsets_of(settled), values, wanted)


def _offsets_of(settled: Settled) -> dict[GridIndex, ViewOffset]:
    return {(view.row, view.column): at for view, at in zip(settled.views, settled.offsets)}


def _settled_scene(scene: Scene, settled: Settled) -> Scene:
    return replace(
        scene,
        arrangement=settled.arrangement,
        grid=grid_of(settled.field),
        row_step=row_step_of(settled.field),
        notes=settled.notes,
    )


def _with_problem(scene: Scene, error: InputError) -> Scene:
    return replace(scene, notes=(*scene.notes, f"{error}."), problems=(f"{error}.",))


def _with_disparity(
    scene: Scene,
    views: Iterable[ViewUpdate],
    offsets: Mapping[GridIndex, ViewOffset],
    values: FloatImage,
    wanted: Wanted,
    origin: str = FROM_VIEWS,
    is_final: bool = True,
) -> LoadedField:
    """Return the field with the disparity (H, W) of its centre view, the first, carried to the others."""
    scene = replace(
        scene,
        disparity_range_px=(float(values.min()), float(values.max())),
        depth_source=origin,
        has_view_disparity=True,
        subject_disparity_px=subject_disparity(values),
    )
    marked = (replace(view, is_final=is_final) for view in views)
    return LoadedField(scene, _carried(marked, offsets, values, scene.grid, wanted))


def _carried(
    views: Iterator[ViewUpdate],
    offsets: Mapping[GridIndex, ViewOffset],
    values: FloatImage,
    grid: GridShape,
    wanted: Wanted,
) -> Iterator[ViewUpdate]:
    """Yield the centre view, then those of the others that are wanted, with the disparity of the centre view."""
    centre = next(views)
    yield replace(centre, disparity=values)
    chosen = wanted()
    others = (
        (view, offsets[view.row, view.column])
        for view in views
        if chosen is None or grid.offset(view.row, view.column) in chosen
    )
    farthest = max(abs(step) for offset in offsets.values() for step in offset)
    with suppress(Cancelled):
        yield from carry(values, centre.colors, others, farthest)


def _scene_as_read(source: Source, field: MultiView, centre: ViewUpdate, range_px: tuple[float, float] | None) -> Scene:
    height, width = image_size(centre.colors)
    return Scene(
        source=source,
        name=field.name,
        width=width,
        height=height,
        grid=grid_of(field),
        missing_views=math.prod(grid_of(field)) - len(field.views),
        row_step=row_step_of(field),
        disparity_range_px=range_px or UNKNOWN_DISPARITY_RANGE_PX,
        depth_source="light field" if centre.disparity is not None else "none",
        is_hdr=field.is_hdr,
        arrangement=source.arrangement,
        notes=field.notes,
        focal_px=field.focal_px,
        infinity_px=None if field.infinity_px is None else field.infinity_px * step_length(field),
        has_view_disparity=len(field.disparity) == len(field.views),
        subject_disparity_px=subject_disparity(centre.disparity) if centre.disparity is not None else 0.0,
    )


def _keep(views: Iterator[ViewUpdate], read: list[ViewUpdate]) -> Iterator[ViewUpdate]:
    """Yield all views as not final and keep them: they come again, with disparity."""
    for view in views:
        read.append(view)
        yield replace(view, is_final=False)


def _require_field(name: str, size: ImageSize, grid: GridShape) -> None:
    """Raise InputError if so many views of this (height, width) do not fit into memory."""
    needed = view_bytes(math.prod(size) * math.prod(grid), is_hdr=False)
    require_memory(needed, f"{name}: {grid.columns} x {grid.rows} views of {size}")
