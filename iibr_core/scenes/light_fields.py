"""A light field from disk for display: as read, and again with disparity if its views have none, so that focusing,
wide apertures and viewpoints between the views work as with a photo; or with views made between its own.
"""

import math
from collections.abc import Generator, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from itertools import chain
from pathlib import Path

from iibr_core.beyond.between_views import GivenView, densify, read_given_views, require_steps
from iibr_core.color import encoded_from_stored
from iibr_core.depth.multi_view.estimate import estimate_coarse
from iibr_core.depth.multi_view.matching import FINDING
from iibr_core.depth.multi_view.reduced import estimate_within_memory
from iibr_core.depth.stereo_pair import MATCHED_PIXELS
from iibr_core.depth.subject import subject_disparity
from iibr_core.formats.images.photo import focal_px_from_fov
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.formats.light_fields.views import disparity_range, grid_of, read_views, step_length
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.inpainting.registry import load_inpainter
from iibr_core.method.light_field import generate
from iibr_core.method.memory import require_memory, view_bytes
from iibr_core.method.plan import plan_literal
from iibr_core.runtime.work import report_progress
from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import (
    Disparity,
    FloatImage,
    GridShape,
    ImageSize,
    InputError,
    Photo,
    StoredColors,
    ViewOffset,
    ViewUpdate,
    image_size,
)

UNKNOWN_DISPARITY_RANGE_PX = (-4.0, 4.0)
"""Range of the focus in a light field without disparity, in pixels per view step."""
FROM_VIEWS = "the views themselves"
READING = "reading views"


@dataclass(frozen=True, eq=False)
class LoadedField:
    """A light field for display.

    views: all its views, the centre first; they are not final if the field comes again with better disparity.
    """

    scene: Scene
    views: Iterator[ViewUpdate]


def load_light_field(source: Source, takes_drafts: bool, known: FloatImage | None = None) -> Iterator[LoadedField]:
    """Yield the light field of a folder or file, again each time its disparity is known better.

    takes_drafts: views without disparity come as read, then with a coarse disparity, then with the final one; otherwise
    the field comes once, when all is known. known: disparity of the centre view that was found before. The views of a
    field must be taken before the next field is asked for.
    """
    field = open_light_field(Path(source.path))
    grid, (size, views) = grid_of(field), read_views(field)
    _require_field(field.name, size, grid)
    given, map_file = known, source.depth.file
    if map_file is not None:
        given = read_disparity(Path(map_file), size, source.depth.file_scale or 1.0).values
    centre = next(views)
    scene = _scene_as_read(source, field, centre, disparity_range(field))
    if (scene.has_view_disparity and given is None) or max(grid) == 1:
        yield LoadedField(scene, chain((centre,), views))
        return
    read: list[ViewUpdate] = []
    if takes_drafts:
        yield LoadedField(scene, _keep(chain((centre,), views), read))
    else:
        for view in chain((centre,), views):
            read.append(view)
            report_progress(len(read), math.prod(grid), READING)
    if given is not None:
        origin = Path(map_file).name if map_file else FROM_VIEWS
        yield _with_disparity(scene, read, given, origin)
    elif centre.disparity is not None:
        yield _with_disparity(scene, read, centre.disparity, scene.depth_source)
    else:
        yield from _with_found_disparity(scene, read, takes_drafts)


def find_disparity(field: MultiView) -> tuple[FloatImage, tuple[str, ...]]:
    """Return the disparity (H, W) of the centre view, of a pair that of the left one, in pixels per view step, and
    notes.
    """
    colors, offsets = _read_for_matching(field)
    report_progress(0, 0, FINDING)
    coarse = estimate_coarse(colors, offsets, 0)
    max_pixels = MATCHED_PIXELS if field.place.is_file() and len(colors) == 2 else None
    values, note = estimate_within_memory(colors, offsets, 0, coarse.range_px, max_pixels)
    return values, (note,) if note else ()


def find_range(field: MultiView) -> tuple[float, float] | None:
    """Return about the least and greatest disparity, in pixels per view step; None if none can be found."""
    with suppress(InputError):
        values = estimate_coarse(*_read_for_matching(field), 0).values
        return float(values.min()), float(values.max())
    return None


def _read_for_matching(field: MultiView) -> tuple[list[StoredColors], list[ViewOffset]]:
    """Return the colours and viewpoints of all views, the centre first, of a pair the left one."""
    grid, (size, views) = grid_of(field), read_views(field)
    _require_field(field.name, size, grid)
    read = sorted(views, key=lambda view: (view.row, view.column) != field.views[field.centre].place)
    return [view.colors for view in read], [grid.offset(view.row, view.column) for view in read]


def read_dense(
    field: MultiView, grid: GridShape, inpaint: str
) -> tuple[Sequence[GivenView], int, Generator[ViewUpdate]]:
    """Read the views of a light field, and begin to make views between them.

    Return its own views, the middle one first; the number of steps from one of them to the next; and all views.
    """
    sparse = grid_of(field)
    steps, inpainter = require_steps(sparse, grid, field.name), load_inpainter(inpaint)
    given = read_given_views(field)
    return given, steps, densify(given, sparse, grid, inpainter)


def _with_found_disparity(scene: Scene, views: Sequence[ViewUpdate], takes_drafts: bool) -> Iterator[LoadedField]:
    """Yield the field with disparity found from its views; without any, and with a note, if they are too small."""
    colors, offsets = [view.colors for view in views], [scene.grid.offset(view.row, view.column) for view in views]
    report_progress(0, 0, FINDING)
    try:
        coarse = estimate_coarse(colors, offsets, 0)
    except InputError as error:
        scene = replace(scene, notes=(*scene.notes, f"{error}."), problems=(f"{error}.",))
        yield LoadedField(scene, iter(views))
        return
    if takes_drafts:
        yield _with_disparity(scene, views, coarse.values, FROM_VIEWS, is_final=False)
    values, note = estimate_within_memory(colors, offsets, 0, coarse.range_px)
    scene = replace(scene, notes=(*scene.notes, note)) if note else scene
    yield _with_disparity(scene, views, values, FROM_VIEWS)


def _with_disparity(
    scene: Scene, views: Sequence[ViewUpdate], values: FloatImage, origin: str, is_final: bool = True
) -> LoadedField:
    """Return the field with the disparity (H, W) of its centre view, carried to the others."""
    scene = replace(
        scene,
        disparity_range_px=(float(values.min()), float(values.max())),
        depth_source=origin,
        has_view_disparity=True,
        subject_disparity_px=subject_disparity(values),
    )
    return LoadedField(scene, _carried(views, values, scene.grid, is_final))


def _carried(views: Sequence[ViewUpdate], values: FloatImage, grid: GridShape, is_final: bool) -> Iterator[ViewUpdate]:
    """Yield the views with the disparity of the centre view, the first, warped to each of them."""
    colors = {(view.row, view.column): view.colors for view in views}
    centre = encoded_from_stored(views[0].colors)
    photo = Photo(centre, focal_px_from_fov(centre.shape[1]), "the centre view")
    disparity = Disparity(values, "the centre view")
    for made in generate(photo, disparity, plan_literal(photo, disparity, grid)):
        yield replace(made, colors=colors[made.row, made.column], inpainted=None, is_final=is_final)


def _scene_as_read(source: Source, field: MultiView, centre: ViewUpdate, range_px: tuple[float, float] | None) -> Scene:
    height, width = image_size(centre.colors)
    return Scene(
        source=source,
        name=field.name,
        width=width,
        height=height,
        grid=grid_of(field),
        disparity_range_px=range_px or UNKNOWN_DISPARITY_RANGE_PX,
        depth_source="light field" if centre.disparity is not None else "none",
        is_hdr=field.is_hdr,
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
