"""Decides where a photo's disparity comes from: a file, the photo itself, a trained model, a rough estimate; in this
order, and says so. What fails is followed by the next; only a file or a model that the user asked for must be good.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from iibr_core.depth.choice import BETTER_WAYS, DepthChoice, DepthKind, DepthOrigin
from iibr_core.depth.edges.map_alignment import lies_at_corners
from iibr_core.depth.edges.refine import refine
from iibr_core.depth.embedded.embedded_depth import read_embedded
from iibr_core.depth.embedded.picture import photo_in_focus, rotate_estimate
from iibr_core.depth.embedded.unread import unread_parts
from iibr_core.depth.estimates import Estimate, inverted, values_of
from iibr_core.depth.estimators.catalog import is_meaning_known, model_to_use
from iibr_core.depth.estimators.estimate_depth import estimate_with
from iibr_core.depth.map_file import (
    depth_beside_picture,
    depth_from_channel,
    depth_from_file,
    depth_of_model,
    depth_of_picture,
    turned_estimate,
)
from iibr_core.depth.pictorial_cues import estimate_from_cues
from iibr_core.depth.scaling import disparity_from, inverse_metres_over
from iibr_core.depth.sidecar import find_sidecar, flat_disparity, sidecars_of
from iibr_core.depth.stereo_pair import estimate_from_pair
from iibr_core.formats.images.decode import read_orientation
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS, read_photo
from iibr_core.formats.maps.disparity_file import filling_note, map_at_size
from iibr_core.formats.maps.resample import is_enlarged_smoothly, without_repeats
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.inpainting.registry import EstimateDepth
from iibr_core.runtime.work import raise_if_stopped, report_progress
from iibr_core.types import (
    Disparity,
    FloatImage,
    GridShape,
    InputError,
    Photo,
)

USUAL_GRID = GridShape(9, 9)
"""What estimates without a scale are made to suit where the grid is not yet known."""
GUESS_SHARE = 0.6
"""Of the usual parallax, for guessed depth: what is wrong moves less."""
NOT_USED: dict[DepthKind, str] = {
    "file": "The map beside the photo was not used",
    "embedded": "The photo's own depth was not used",
    "model": "The depth model was not used",
    "rough": "Depth could not be guessed",
}


@dataclass(frozen=True, eq=False)
class PhotoWithDepth:
    """A photo, its disparity at the same size, and where that came from."""

    photo: Photo
    disparity: Disparity
    origin: DepthOrigin


@dataclass(frozen=True, eq=False)
class _FoundDepth:
    """What one source gave: an estimate of any kind and size. photo: the one to show with it."""

    photo: Photo
    origin: DepthOrigin
    depth: Estimate
    notes: tuple[str, ...] = ()


def open_with_depth(
    path: Path,
    choice: DepthChoice | None = None,
    max_pixels: int = DEFAULT_MAX_PIXELS,
    grid: GridShape | None = None,
    asks_model: bool = True,
) -> PhotoWithDepth:
    """Read a photo and find its disparity; every photo gets one. asks_model: else a guess takes a model's place, which
    `ask_model` may replace later.

    A photo that the camera blurred is replaced by the sharp picture beside it, where its own depth comes with one.
    Raises InputError for a bad photo, for a bad file or model that `choice` names, and where it asks for a model and
    there is none; Cancelled.
    """
    choice, path = choice or DepthChoice(), Path(path)
    photo = read_photo(path, max_pixels, keeps_primaries=True)
    search = _DepthSearch(path, photo, choice, max_pixels)
    if choice.file is not None:
        return _finish(search.of_file(Path(choice.file)), choice, grid)
    failures: tuple[str, ...] = ()
    for kind, find in search.sources():
        if kind == "model" and not asks_model:
            continue
        try:
            if (found := find()) is not None:
                found = replace(found, origin=replace(found.origin, failures=failures))
                return _finish(found, choice, grid)
        except InputError as error:
            if kind == "model" and choice.asks_for_model:
                raise
            failures += (f"{NOT_USED[kind]}: {error}",)
    return _flat(photo, failures)


def ask_model(
    path: Path,
    photo: Photo,
    choice: DepthChoice,
    grid: GridShape | None = None,
) -> PhotoWithDepth:
    """A photo that was read from `path`, its disparity estimated by the model that `choice` names, or the usual one.

    Raises InputError where there is none or it cannot be used.
    """
    choice = replace(choice, start="model")
    search = _DepthSearch(path, photo, choice, math.prod(photo.size))
    found = search.model()
    assert found is not None
    return _finish(found, choice, grid)


def sketch_depth(path: Path, photo: Photo, choice: DepthChoice) -> PhotoWithDepth:
    """What `open_with_depth` will find, as far as that is quick: of a small picture of the photo, edges as they come,
    and a guess where that will ask a model or compare two views.

    Raises InputError, Cancelled as that does.
    """
    height, width = photo.size
    search = _DepthSearch(path, photo, choice, height * width)
    choice = replace(choice, refine=False)
    if choice.file is not None:
        return _finish(search.of_file(Path(choice.file)), choice, None)
    if choice.start == "flat":
        return _flat(photo, ())
    ways = (search.sidecar, search.embedded_map) if choice.start == "auto" else (search.embedded_map,)
    for find in ways if choice.start in ("auto", "embedded") else ():
        with suppress(InputError):  # it is told when all is read
            if (found := find()) is not None:
                return _finish(found, choice, None)
    return _finish(search.rough(), choice, None)


def read_shown_photo(path: Path, max_pixels: int, kind: DepthKind) -> Photo:
    """The photo that `open_with_depth` shows, max_pixels large at most; kind: where it found the depth.

    Raises InputError as that does.
    """
    photo = read_photo(path, max_pixels, keeps_primaries=True)
    embedded = read_embedded(path) if kind == "embedded" else None
    return photo if embedded is None else photo_in_focus(path, photo, embedded, max_pixels)


def estimator_of(found: PhotoWithDepth, choice: DepthChoice) -> EstimateDepth | None:
    """What gave a photo's depth, for pictures of its size; None where that was no model."""
    if found.origin.kind != "model":
        return None

    def estimate(colors: FloatImage) -> FloatImage:
        model = model_to_use(choice)
        if model is None:
            raise InputError(f"{found.origin.words}: the model no longer exists")
        depth = estimate_with(model, replace(found.photo, pixels=colors))
        if found.origin.near:  # the first estimate decided, for all
            depth = turned_estimate(depth, (found.origin.near == "the high end") != choice.inverts, choice)
        return _at_size(disparity_from(_as_chosen(depth, choice), USUAL_GRID), found.photo)

    return estimate


def disparity_of_file(
    file: Path, photo: Photo, choice: DepthChoice, grid: GridShape | None = None, photo_path: Path | None = None
) -> Disparity:
    """The disparity that a map's file gives a photo, px of the photo from view to view, unknown values filled.

    photo_path: where the photo is, see `depth_from_file`. Raises InputError where the map cannot be used.
    """
    found = depth_from_file(file, photo, choice, photo_path)
    return _disparity_at(photo, found.estimate, file.name, choice, grid)


@dataclass(frozen=True, eq=False)
class _DepthSearch:
    """One photo on its way to its depth. The methods give None where there is nothing to read."""

    path: Path
    photo: Photo
    choice: DepthChoice
    max_pixels: int

    def sources(self) -> Iterator[tuple[DepthKind, Callable[[], _FoundDepth | None]]]:
        ways: dict[DepthKind, Callable[[], _FoundDepth | None]] = {
            "file": self.sidecar,
            "embedded": self.embedded,
            "model": self.model,
            "rough": self.rough,
        }
        kinds: list[DepthKind] = [*ways, "flat"]
        start = 0 if self.choice.start == "auto" else kinds.index(self.choice.start)
        for kind in kinds[start:-1]:
            yield kind, ways[kind]

    def of_file(self, path: Path) -> _FoundDepth:
        found = depth_from_file(path, self.photo, self.choice, self.path)
        origin = DepthOrigin("file", path.name, file=str(path), near=found.near)
        return _FoundDepth(self.photo, origin, found.estimate, found.notes + self._unused_maps(path))

    def _unused_maps(self, used: Path) -> tuple[str, ...]:
        """A note where the photo has other maps, too: they may say something else."""
        unused = [other.name for other in sidecars_of(self.path) if other.resolve() != used.resolve()]
        with suppress(InputError):  # a damaged one would not be used either
            embedded = read_embedded(self.path)
            unused += [f"the photo's own ({embedded.format})"] if embedded is not None else []
        return (f"Only {used.name} counts; not used: {', '.join(unused)}.",) if unused else ()

    def sidecar(self) -> _FoundDepth | None:
        path = find_sidecar(self.path)
        return self.of_file(path) if path is not None else None

    def embedded(self) -> _FoundDepth | None:
        return self.embedded_map() or self.of_pair()

    def embedded_map(self) -> _FoundDepth | None:
        for read, words in ((depth_from_channel, "depth channel"), (depth_beside_picture, "its other half")):
            found = read(self.path, self.photo, self.choice)
            if found is not None:
                origin = DepthOrigin("embedded", f"the photo itself ({words})", near=found.near)
                return _FoundDepth(self.photo, origin, found.estimate, found.notes)
        embedded = read_embedded(self.path)
        if embedded is None:
            return None
        photo = photo_in_focus(self.path, self.photo, embedded, self.max_pixels)
        origin = DepthOrigin("embedded", f"the photo itself ({embedded.format})")
        estimate = rotate_estimate(embedded.estimate, photo.size, read_orientation(self.path))
        if embedded.says_near_end:
            return _FoundDepth(photo, origin, estimate, embedded.notes)
        told = depth_of_picture(self.path, values_of(estimate), photo, self.choice)
        return _FoundDepth(photo, replace(origin, near=told.near), told.estimate, embedded.notes + told.notes)

    def of_pair(self) -> _FoundDepth | None:
        found = estimate_from_pair(self.path)
        if found is None:
            return None
        estimate, layout = found
        return _FoundDepth(self.photo, DepthOrigin("embedded", f"the photo's two views ({layout})"), estimate)

    def model(self) -> _FoundDepth | None:
        model = model_to_use(self.choice)
        if model is None:
            return None
        raise_if_stopped()
        estimate = estimate_with(model, self.photo)
        told = depth_of_model(model.title, estimate, is_meaning_known(model), self.photo, self.choice)
        origin = DepthOrigin("model", f"estimated by {model.title}", near=told.near)
        return _FoundDepth(self.photo, origin, told.estimate, told.notes)

    def rough(self) -> _FoundDepth:
        raise_if_stopped()
        report_progress(0, 0, "guessing depth")
        estimate = estimate_from_cues(self.photo)
        origin = DepthOrigin("rough", "rough, guessed without a model", (), BETTER_WAYS)
        return _FoundDepth(self.photo, origin, estimate, unread_parts(self.path))


def _finish(found: _FoundDepth, choice: DepthChoice, grid: GridShape | None) -> PhotoWithDepth:
    """Disparity at the photo's size, whole, its edges drawn to the photo's. Raises InputError where none is known."""
    photo, origin = found.photo, found.origin
    name = origin.words if origin.kind == "file" else "its depth"
    disparity = _disparity_at(photo, found.depth, name, choice, grid)
    values, holes = disparity.values, disparity.unknown
    if choice.refine:
        values = refine(photo.pixels, values, holes, is_enlarged=disparity.is_enlarged)
    share = GUESS_SHARE if origin.kind == "rough" else 1.0
    notes = found.notes + origin.failures + ((origin.advising_line,) if origin.advice else ())
    disparity = replace(
        disparity, values=values, source=origin.words, notes=disparity.notes + notes, viewing_share=share
    )
    return PhotoWithDepth(photo, disparity, origin)


def _disparity_at(
    photo: Photo,
    estimate: Estimate,
    name: str,
    choice: DepthChoice,
    grid: GridShape | None,
) -> Disparity:
    """An estimate's disparity at the photo's size, what is unknown filled by what looks like it.

    name: for the notes. Raises InputError where nothing is known.
    """
    estimate = _as_chosen(estimate, choice)
    values = disparity_from(estimate, grid or USUAL_GRID)
    inverse_metres = inverse_metres_over(estimate, values)
    ratio, notes = photo.size.width / values.shape[1], filling_note(name, values)
    is_enlarged = is_enlarged_smoothly(without_repeats(values), photo.size)
    values = _at_size(values, photo)
    if inverse_metres is not None:
        inverse_metres = inverse_metres[0] / ratio, inverse_metres[1]
    holes = np.isnan(values)
    if holes.all():
        raise InputError(f"{name}: too few known values survive at the photo's size; give a denser map")
    if holes.any():
        values = fill_disparity_by_color(photo.pixels, values)
    return Disparity(values, name, notes, inverse_metres, holes if holes.any() else None, is_enlarged=is_enlarged)


def _as_chosen(estimate: Estimate, choice: DepthChoice) -> Estimate:
    return inverted(estimate) if choice.inverts else estimate


def _at_size(disparity: FloatImage, photo: Photo) -> FloatImage:
    """Disparity (h, w) of a photo, px of the map, at the photo's size, px of that."""
    small = without_repeats(disparity)
    values = map_at_size(small, photo.size, lies_at_corners(photo.pixels, small))
    return values * np.float32(photo.size.width / disparity.shape[1])


def _flat(photo: Photo, failures: tuple[str, ...]) -> PhotoWithDepth:
    flat = flat_disparity(photo.size)
    origin = DepthOrigin("flat", flat.source, failures, BETTER_WAYS)
    return PhotoWithDepth(photo, replace(flat, notes=flat.notes + failures), origin)
