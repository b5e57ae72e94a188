"""Find the disparity of a photo: in a file, in the photo itself, by a model, or by a guess; in this order.

If a source fails, the next one is tried and a note names the failure. A file or a model that the user names must be
good: otherwise InputError is raised.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal, get_args

import numpy as np

from iibr_core.depth.choice import DepthChoice, DepthKind, DepthOrigin
from iibr_core.depth.edges.refine import refine
from iibr_core.depth.embedded.embedded import photo_in_focus, read_embedded, rotate_estimate, unread_parts
from iibr_core.depth.estimate import DepthEstimate, disparity_from
from iibr_core.depth.guess import guess_depth
from iibr_core.depth.map_file import as_estimate, depth_from_file, orient_map
from iibr_core.depth.map_numbers import numbers_of
from iibr_core.depth.models.catalog import model_to_use
from iibr_core.depth.sidecar import find_sidecars, unused_map_notes
from iibr_core.depth.stereo_pair import estimate_from_pair
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS, focal_px_from_fov, read_photo
from iibr_core.formats.images.rgbd import rgbd_parts
from iibr_core.formats.maps.disparity_file import filling_note, map_at_size
from iibr_core.formats.maps.reader import MapFile, read_depth_channel, read_map_picture
from iibr_core.formats.maps.resample import is_enlarged_smoothly, without_repeats
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.inpainting.registry import EstimateDepth
from iibr_core.remedies import FixableNote, remedy_of
from iibr_core.runtime.work import raise_if_stopped, report_progress
from iibr_core.types import Disparity, FloatImage, GridShape, InputError, Photo

USUAL_GRID = GridShape(9, 9)
"""Grid of views that depth without a scale is made for while the real one is unknown."""
SUBJECTS: dict[DepthKind, str] = {
    "file": "The map beside the photo",
    "embedded": "The photo's own depth",
    "model": "The depth model",
    "rough": "The guess",
}
"""Subjects of the sentence about a source that fails."""

SlowSource = Literal["pair", "model"]
"""Sources that take long: matching two views, and a model."""
Source = tuple[DepthKind, Callable[[], "PhotoWithDepth | None"]]


@dataclass(frozen=True, eq=False)
class PhotoWithDepth:
    """A photo, its disparity at the same size, and the origin of the disparity."""

    photo: Photo
    disparity: Disparity
    origin: DepthOrigin


def open_with_depth(
    path: Path,
    choice: DepthChoice | None = None,
    max_pixels: int = DEFAULT_MAX_PIXELS,
    grid: GridShape | None = None,
    skipped: Collection[SlowSource] = (),
) -> PhotoWithDepth:
    """Read a photo and find its disparity, see `find_depth`. Raises InputError for a bad photo."""
    photo = read_photo(Path(path), max_pixels, keeps_primaries=True)
    return find_depth(path, photo, choice or DepthChoice(), grid, skipped, max_pixels)


def find_depth(
    path: Path,
    photo: Photo,
    choice: DepthChoice,
    grid: GridShape | None = None,
    skipped: Collection[SlowSource] = (),
    max_pixels: int | None = None,
) -> PhotoWithDepth:
    """Find the disparity of a photo that was read from `path`; every photo gets one.

    grid: shape of the grid of views, None if it is not known yet. skipped: slow sources that are not tried. max_pixels:
    limit for the sharp picture that replaces a photo which the camera blurred; None: the photo's size. Raises
    InputError if a file or a model that `choice` names is bad, or it asks for a model and there is none.
    """
    search = _Search(Path(path), photo, choice, grid, max_pixels or math.prod(photo.size))
    if choice.file is not None:
        return search.file(Path(choice.file))
    if choice.right is not None and "pair" not in skipped and (found := search.pair()) is not None:
        return found
    kinds: tuple[DepthKind, ...] = get_args(DepthKind)
    failures: tuple[str, ...] = ()
    first = 0 if choice.start == "auto" else kinds.index(choice.start)
    for kind, find in search.sources(skipped):
        if kinds.index(kind) < first:
            continue
        try:
            found = find()
        except InputError as error:
            if kind == "model" and choice.asks_for_model:
                raise
            failure, remedy = f"{SUBJECTS[kind]} was not used: {error}", remedy_of(error)
            failure = failure if remedy is None else FixableNote(failure, remedy)
            failures += () if failure in failures else (failure,)
            continue
        if found is not None:
            return _with_failures(found, failures)
    flat = Disparity(np.zeros(photo.size, np.float32), "none")
    return _with_failures(PhotoWithDepth(photo, flat, DepthOrigin("flat", "none")), failures)


def estimator_of(found: PhotoWithDepth, choice: DepthChoice) -> EstimateDepth | None:
    """Return the function by which a model estimated a photo's depth, for pictures of its size; None without a model.

    The near end of the values stays the one that was found for the photo.
    """
    if found.origin.kind != "model":
        return None

    def estimate(colors: FloatImage) -> FloatImage:
        model = model_to_use(choice)
        if model is None:
            raise InputError(f"{found.origin.words}: the model no longer exists")
        depth = model.estimate(replace(found.photo, pixels=colors))
        if found.origin.near:
            is_large_near = (found.origin.near == "the high end") != choice.inverts
            depth = as_estimate(
                numbers_of(MapFile(depth.values, "floats")), is_large_near, choice.is_metric or depth.is_metric
            )
        values, _ = disparity_from(depth.inverted if choice.inverts else depth, USUAL_GRID)
        return _at_size(without_repeats(values), values.shape[1], found.photo)

    return estimate


@dataclass(frozen=True, eq=False)
class _Search:
    """Sources of one photo's depth. Each returns None if it holds nothing, and raises InputError if it is bad."""

    path: Path
    photo: Photo
    choice: DepthChoice
    grid: GridShape | None
    max_pixels: int

    def sources(self, skipped: Collection[SlowSource]) -> Iterator[Source]:
        """Yield the sources with their kinds, best first."""
        yield "file", self.sidecar
        yield "embedded", self.part_of_picture
        yield "embedded", self.embedded
        if "pair" not in skipped:
            yield "embedded", self.pair
        if "model" not in skipped:
            yield "model", self.model
        yield "rough", self.guess

    def sidecar(self) -> PhotoWithDepth | None:
        paths = find_sidecars(self.path)
        return self.file(paths[0]) if paths else None

    def file(self, path: Path) -> PhotoWithDepth:
        depth = depth_from_file(path, self.path, self.photo, self.choice)
        unused = ", ".join(other.name for other in find_sidecars(self.path) if other.resolve() != path.resolve())
        notes = (f"Only {path.name} counts; not used: {unused}.",) if unused else ()
        origin = DepthOrigin("file", path.name, file=str(path), near=depth.near)
        return self.finish(origin, depth.estimate, depth.notes + notes)

    def part_of_picture(self) -> PhotoWithDepth | None:
        distances, parts = read_depth_channel(self.path), rgbd_parts(self.path)
        if distances is not None:
            return self.map_inside("depth channel", MapFile(distances, "floats"), is_distance=True)
        return self.map_inside("its other half", read_map_picture(parts[1])) if parts is not None else None

    def embedded(self) -> PhotoWithDepth | None:
        embedded = read_embedded(self.path)
        if embedded is None:
            return None
        photo = photo_in_focus(self.path, self.photo, embedded, self.max_pixels)
        search = replace(self, photo=photo)
        estimate = rotate_estimate(embedded.estimate, photo.size, open_picture(self.path).orientation)
        if embedded.says_near_end:
            origin = DepthOrigin("embedded", f"the photo itself ({embedded.format})")
            return search.finish(origin, estimate, embedded.notes)
        return search.map_inside(embedded.format, MapFile(estimate.values, "integers", notes=embedded.notes))

    def map_inside(self, name: str, found: MapFile, is_distance: bool = False) -> PhotoWithDepth:
        """Return the depth of a map in the photo's file, after its near end was found."""
        depth = orient_map(self.path.name, numbers_of(found), self.photo, self.choice, is_distance)
        origin = DepthOrigin("embedded", f"the photo itself ({name})", near=depth.near)
        return self.finish(origin, depth.estimate, found.notes + depth.notes)

    def pair(self) -> PhotoWithDepth | None:
        found = estimate_from_pair(self.path, None if self.choice.right is None else Path(self.choice.right))
        if found is None:
            return None
        estimate, layout = found
        return self.finish(DepthOrigin("embedded", f"the photo's two views ({layout})"), estimate)

    def model(self) -> PhotoWithDepth | None:
        model = model_to_use(self.choice)
        if model is None:
            return None
        raise_if_stopped()
        words = f"estimated by {model.title}"
        estimate, origin = model.estimate(self.photo), DepthOrigin("model", words, model=model.name)
        if estimate.meaning == "disparity" or model.is_meaning_known:
            return self.finish(origin, estimate)
        values = numbers_of(MapFile(estimate.values, "floats"))
        depth = orient_map(
            model.title, values, self.photo, self.choice, estimate.is_metric, is_stated=estimate.is_metric
        )
        oriented = replace(depth.estimate, focal_ratio=estimate.focal_ratio)
        return self.finish(replace(origin, near=depth.near), oriented, depth.notes)

    def guess(self) -> PhotoWithDepth:
        raise_if_stopped()
        report_progress(0, 0, "guessing depth")
        estimate = guess_depth(self.photo)
        notes = unread_parts(self.path) + unused_map_notes(self.path)
        return self.finish(DepthOrigin("rough", "rough, guessed without a model"), estimate, notes)

    def finish(self, origin: DepthOrigin, estimate: DepthEstimate, notes: tuple[str, ...] = ()) -> PhotoWithDepth:
        """Return the photo with the disparity of an estimate at its size, holes filled, edges drawn to the photo's."""
        photo, name = _with_focal(self.photo, estimate), origin.words if origin.kind == "file" else "its depth"
        values, metres = disparity_from(estimate.inverted if self.choice.inverts else estimate, self.grid or USUAL_GRID)
        notes = filling_note(name, values) + notes
        if metres is not None:
            metres = metres[0] * values.shape[1] / photo.size.width, metres[1]
        small = without_repeats(values)
        is_enlarged = is_enlarged_smoothly(small, photo.size)
        values = _at_size(small, values.shape[1], photo)
        holes = np.isnan(values)
        if holes.all():
            raise InputError(f"{name}: too few known values survive at the photo's size; give a denser map")
        unknown = holes if holes.any() else None
        if unknown is not None:
            values = fill_disparity_by_color(photo.pixels, values)
        if self.choice.refine:
            values = refine(photo.pixels, values, unknown, is_enlarged=is_enlarged)
        disparity = Disparity(values, origin.words, notes, metres, unknown, is_enlarged)
        return PhotoWithDepth(photo, disparity, origin)


def _with_focal(photo: Photo, estimate: DepthEstimate) -> Photo:
    """Return the photo with the focal length that was estimated with its depth, unless its file states one."""
    width, ratio = photo.size.width, estimate.focal_ratio
    is_known = photo.focal_px != focal_px_from_fov(width)
    return photo if ratio is None or is_known else replace(photo, focal_px=ratio * width)


def _at_size(small: FloatImage, width: int, photo: Photo) -> FloatImage:
    """Return a map in px of a picture of this width, at the photo's size in its px."""
    values = map_at_size(small, photo.size)
    return values * np.float32(photo.size.width / width)


def _with_failures(found: PhotoWithDepth, failures: tuple[str, ...]) -> PhotoWithDepth:
    """Return the photo with notes on the sources that failed before."""
    origin = replace(found.origin, failures=failures)
    notes = (*found.disparity.notes, *failures)
    return replace(found, disparity=replace(found.disparity, notes=notes), origin=origin)
