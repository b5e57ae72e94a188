"""Read the views of a light field on disk whose views fill a grid, the centre first."""

import math
from collections.abc import Iterable, Iterator, Sequence
from itertools import tee
from statistics import fmean

from iibr_core.color import stored_from_encoded
from iibr_core.formats.images.photo import encoded_colors
from iibr_core.formats.images.picture import Picture
from iibr_core.formats.images.picture_source import PictureSource, part_of, read_source
from iibr_core.formats.light_fields.multi_view_scene import GridIndex, MultiView, common_size
from iibr_core.formats.light_fields.order import grid_of, indices_of, step_length
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.types import (
    FloatImage,
    GridShape,
    ImageSize,
    InputError,
    StoredColors,
    ViewOffset,
    ViewUpdate,
    Wanted,
    image_size,
)

EQUAL_STEPS = 0.01
"""Largest share by which the distances of rows and of columns differ that count as equal."""


def read_views(scene: MultiView, wanted: Wanted = lambda: None) -> tuple[ImageSize, Iterator[ViewUpdate]]:
    """Return the size of the views, and an iterator that reads them: the centre first, then the nearest to it.

    wanted: called after the centre was taken; returns the offsets of the views to read, None for all.
    """
    grid, size = grid_of(scene), common_size(scene.views)
    return size, _iterate_views(scene, grid, size, wanted)


def read_stored_view(scene: MultiView, row: int, column: int) -> StoredColors:
    """Return the colours (H, W, 3) of one view."""
    grid = grid_of(scene)
    if (row, column) not in indices_of(scene):
        raise InputError(f"{scene.place}: has {grid.rows}x{grid.columns} views, none in row {row}, column {column}")
    return next(_read_colors(scene, [indices_of(scene)[row, column]]))


def disparity_range(scene: MultiView) -> tuple[float, float] | None:
    """Return the least and greatest disparity (px per step of the grid), as stated or of the map nearest to the centre;
    None if neither is known.
    """
    grid, indices = grid_of(scene), indices_of(scene)
    if scene.range_px is not None:
        low, high = scene.range_px
        return low * step_length(scene), high * step_length(scene)
    known = next((indices[at] for at in _nearest_to_centre(grid) if indices.get(at) in scene.disparity), None)
    if known is None:
        return None
    values = _read_map(scene, known, common_size(scene.views[:1]))
    return float(values.min()), float(values.max())


def view_offsets(scene: MultiView) -> list[ViewOffset]:
    """Return the viewpoint of each view from the central one, in steps of the grid, as positions in names have it."""
    step, (t, s) = step_length(scene), scene.views[scene.centre].offset
    return [ViewOffset((view.offset.t - t) / step, (view.offset.s - s) / step) for view in scene.views]


def in_order_of(scene: MultiView, views: Sequence[ViewUpdate]) -> list[ViewUpdate]:
    """Return all views of a grid in the order of the scene's."""
    by_place = {(view.row, view.column): view for view in views}
    return [by_place[view.place] for view in scene.views if view.place is not None]


def offsets_by_place(scene: MultiView) -> dict[GridIndex, ViewOffset]:
    """Return the viewpoint of each view by its row and column, in steps of the grid from the view that is read first.

    That is the middle view of the grid, which is not always the central one of the scene, as of a pair.
    """
    indices, step = indices_of(scene), step_length(scene)
    t, s = scene.views[indices[_places_read(scene)[0]]].offset
    offsets = {place: scene.views[index].offset for place, index in indices.items()}
    return {place: ViewOffset((at.t - t) / step, (at.s - s) / step) for place, at in offsets.items()}


def _places_read(scene: MultiView) -> list[GridIndex]:
    """Return the places of the views in the order in which they are read."""
    indices = indices_of(scene)
    return [at for at in _nearest_to_centre(grid_of(scene)) if at in indices]


def row_step_of(scene: MultiView) -> float:
    """Return the mean distance between rows, in distances between columns; 1 where there is none to compare."""
    grid, offsets = grid_of(scene), offsets_by_place(scene)
    if min(grid) == 1:
        return 1.0
    below, right = grid.rows - 1, grid.columns - 1
    down = fmean(offsets[below, u].t - offsets[0, u].t for u in range(grid.columns) if (0, u) in offsets) / below
    across = fmean(offsets[v, right].s - offsets[v, 0].s for v in range(grid.rows) if (v, 0) in offsets) / right
    is_equal = min(down, across) <= 0 or abs(down / across - 1) < EQUAL_STEPS
    return 1.0 if is_equal else down / across


def _nearest_to_centre(grid: GridShape) -> list[GridIndex]:
    places = [(row, column) for row in range(grid.rows) for column in range(grid.columns)]
    return sorted(places, key=lambda at: math.hypot(*grid.offset(*at)))


def _iterate_views(scene: MultiView, grid: GridShape, size: ImageSize, wanted: Wanted) -> Iterator[ViewUpdate]:
    indices = indices_of(scene)
    first, *others = _places_read(scene)

    def places() -> Iterator[GridIndex]:
        yield first
        chosen = wanted()
        yield from (at for at in others if chosen is None or grid.offset(*at) in chosen)

    to_read, to_place = tee(places())
    for colors, at in zip(_read_colors(scene, (indices[at] for at in to_read)), to_place):
        index = indices[at]
        if image_size(colors) != size:
            path = scene.views[index].path
            raise InputError(f"{path}: is {image_size(colors)}, but the other views are {size}")
        disparity = _read_map(scene, index, size) if index in scene.disparity else None
        yield ViewUpdate(*at, colors, disparity)


def _read_colors(scene: MultiView, indices: Iterable[int]) -> Iterator[StoredColors]:
    """Yield the colours (H, W, 3) of views; a picture that holds several of them is decoded once."""
    decoded: tuple[PictureSource, Picture] | None = None
    for index in indices:
        source = scene.views[index].picture
        if decoded is None or decoded[0] != source.whole:
            decoded = None  # frees the last picture before the next is decoded
            decoded = source.whole, read_source(source.whole)
        picture = decoded[1] if source == source.whole else part_of(decoded[1], source)
        yield stored_from_encoded(encoded_colors(picture), scene.is_hdr)


def _read_map(scene: MultiView, index: int, size: ImageSize) -> FloatImage:
    """Return the disparity (H, W) of a view in px per step of the grid."""
    known = scene.disparity[index]
    return read_disparity(known.path, size, known.scale * step_length(scene)).values
