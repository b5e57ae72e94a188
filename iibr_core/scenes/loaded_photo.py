"""A photo and its disparity as the worker holds them: read once, then refined and edited as often as the user likes."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from iibr_core.depth.choice import DepthOrigin
from iibr_core.depth.editing.edits import BRUSH_TOOLS, DepthEdits, Levels, Stroke, levels_of
from iibr_core.formats.files import require_file
from iibr_core.formats.light_fields.light_field_formats import is_view_file
from iibr_core.runtime.machine import give_back_memory
from iibr_core.scenes.scene import DepthSettings, Source
from iibr_core.types import Disparity, ImageSize, InputError, Photo, ReportProgress, ignore_progress

if TYPE_CHECKING:
    from iibr_core.depth.editing.canvas import DepthCanvas
    from iibr_core.depth.search import PhotoWithDepth

TELL_EVERY_S = 0.1
SKETCH = ImageSize(height=480, width=480)
"""A sketch fits within this."""
SKETCH_WORTH_PIXELS = 1_500_000
"""Smaller photos are read in no time."""
NOT_YET = 0.0
"""Strength of refinement while a photo is read: none, it follows afterwards, each time the user changes it."""


@dataclass(frozen=True, eq=False)
class LoadedPhoto:
    """A photo as read and its disparity, kept so that another plan does not read them again.

    disparity: what `depth_settings` made of what was `found`, by way of what was `refined`. origin: where it was found.
    settings: text of the settings the photo was saved with by this program, "" without. model: name or path of the
    depth model that its depth is from, None where it is from elsewhere. levels: of what was refined. canvas: of the
    worker's edits, used by the worker alone. own_size: of the photo as its file has it, upright. stamp: of that file,
    see `stamp_of`.
    """

    photo: Photo
    disparity: Disparity
    origin: DepthOrigin
    settings: str
    model: str | None
    depth_settings: DepthSettings
    found: Disparity
    refined: Disparity
    levels: Levels
    canvas: DepthCanvas
    own_size: ImageSize
    stamp: tuple[int, ...]


def stamp_of(path: Path) -> tuple[int, ...]:
    """Return a stamp that changes when another file takes the place of this one. Raises InputError without a file."""
    require_file(path)
    status = path.stat()
    return status.st_ino, status.st_size, status.st_mtime_ns


def load_photo(
    source: Source,
    report_progress: ReportProgress = ignore_progress,
    depth_settings: DepthSettings | None = None,
    asks_model: bool = True,
) -> LoadedPhoto:
    """Read a photo and find its disparity; progress is reported ten times a second at most.

    depth_settings: what to make of the disparity, None for what the source says. asks_model: see `open_with_depth`.
    Raises InputError.
    """
    from iibr_core.depth.search import open_with_depth
    from iibr_core.formats.images.metadata import settings_text_in

    said_at: dict[str, float] = {}

    def report_at_times(done: float, total: float, doing: str) -> None:
        now = time.perf_counter()
        if now - said_at.get(doing, -math.inf) >= TELL_EVERY_S:
            said_at[doing] = now
            report_progress(done, total, doing)

    path = Path(source.path)
    max_pixels, stored_size = _pixels_to_read(source)
    stamp = stamp_of(path)
    found = open_with_depth(
        path,
        replace(source.depth, refine=NOT_YET),
        max_pixels,
        source.grid,
        report_at_times,
        asks_model,
    )
    give_back_memory()
    settings = settings_text_in(path)
    settings_wanted = depth_settings or DepthSettings(source.depth.refine)
    own_size = _turned_like(stored_size, found.photo.size)
    return _prepare(found, settings, source, settings_wanted, (own_size, stamp))


def deepen(source: Source, loaded: LoadedPhoto, refine: float) -> LoadedPhoto:
    """The same photo with what a depth model makes of it, refined so far and not edited.

    Raises InputError.
    """
    from iibr_core.depth.search import ask_model

    choice = replace(source.depth, refine=NOT_YET)
    found = ask_model(Path(source.path), loaded.photo, choice, source.grid)
    file = loaded.own_size, loaded.stamp
    return _prepare(found, loaded.settings, source, DepthSettings(refine), file)


def sketch_photo(source: Source) -> LoadedPhoto | None:
    """A large photo in small, with depth that is found quickly: something to look at while it is read. None where that
    is no use.

    Raises InputError.
    """
    from iibr_core.depth.search import sketch_depth
    from iibr_core.formats.images.photo import focal_px_from_fov, read_thumbnail

    path = Path(source.path)
    max_pixels, stored = _pixels_to_read(source)
    stamp = stamp_of(path)
    if source.is_literal or min(math.prod(stored), max_pixels) < SKETCH_WORTH_PIXELS:
        return None
    pixels = read_thumbnail(path, SKETCH)
    encoded = pixels.astype(np.float32) / np.float32(255)
    photo = Photo(encoded, focal_px_from_fov(encoded.shape[1]), path.stem, is_hdr=False)
    found = sketch_depth(path, photo, source.depth)
    own_size = _turned_like(stored, photo.size)
    return _prepare(found, "", source, DepthSettings(NOT_YET), (own_size, stamp))


def photo_of_arrays(photo: Photo, disparity: Disparity) -> LoadedPhoto:
    """A photo and its disparity as they were given, from no file: nothing is refined."""
    from iibr_core.depth.search import PhotoWithDepth

    found = PhotoWithDepth(photo, disparity, DepthOrigin("file", disparity.source))
    return _prepare(found, "", Source(""), DepthSettings(NOT_YET), (photo.size, ()))


def apply_depth_settings(loaded: LoadedPhoto, depth_settings: DepthSettings) -> LoadedPhoto:
    """The same with something else made of its disparity; only what changed is worked out.

    Raises InputError.
    """
    if loaded.depth_settings == depth_settings:
        return loaded
    if loaded.depth_settings.refine != depth_settings.refine:
        loaded = _refine(loaded, depth_settings.refine)
    values = loaded.canvas.apply(depth_settings.edits)
    return replace(loaded, depth_settings=depth_settings, disparity=replace(loaded.refined, values=values))


def without_history(loaded: LoadedPhoto) -> LoadedPhoto:
    """The same with a new canvas: one that was painted on keeps maps to go back to."""
    from iibr_core.depth.editing.canvas import DepthCanvas

    return replace(loaded, canvas=DepthCanvas(loaded.photo.pixels, loaded.refined.values))


def _turned_like(size: ImageSize, upright: ImageSize) -> ImageSize:
    """Return the size of a stored picture after it was turned upright."""
    is_turned = (size.height < size.width) != (upright.height < upright.width) and size.height != size.width
    return ImageSize(size.width, size.height) if is_turned else size


def _pixels_to_read(source: Source) -> tuple[int, ImageSize]:
    """Return how large a photo is read at most, and its stored size. Raises InputError for files of views."""
    from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
    from iibr_core.formats.images.side_by_side import photo_size

    path = Path(source.path)
    if is_view_file(path):
        raise InputError(
            f"{path}: holds the views of a light field, not a photo; `iibr view`, export and depth read it"
        )
    return source.max_pixels or DEFAULT_MAX_PIXELS, photo_size(path)


def prepare_brush() -> None:
    """Have the brush's kernels loaded, or compiled, so that the first stroke does not wait for them."""
    from iibr_core.depth.editing.canvas import DepthCanvas

    strokes = tuple(Stroke(tool, ((0.5, 0.5),), 0.1, 0.5) for tool in BRUSH_TOOLS)
    DepthCanvas(np.zeros((4, 4, 3), np.float32), np.zeros((4, 4), np.float32)).apply(DepthEdits(strokes=strokes))


def _prepare(
    found: PhotoWithDepth,
    settings: str,
    source: Source,
    depth_settings: DepthSettings,
    file: tuple[ImageSize, tuple[int, ...]],
) -> LoadedPhoto:
    from iibr_core.depth.editing.canvas import DepthCanvas
    from iibr_core.depth.estimators.catalog import USUAL_MODEL

    values = found.disparity
    canvas = DepthCanvas(found.photo.pixels, values.values)
    as_found = DepthSettings(NOT_YET)
    levels = levels_of(values.values)
    model = (source.depth.model or USUAL_MODEL) if found.origin.kind == "model" else None
    loaded = LoadedPhoto(
        found.photo, values, found.origin, settings, model, as_found, values, values, levels, canvas, *file
    )
    return apply_depth_settings(loaded, depth_settings)


def _refine(loaded: LoadedPhoto, strength: float) -> LoadedPhoto:
    from iibr_core.depth.edges.refine import refine
    from iibr_core.depth.editing.canvas import DepthCanvas

    values = loaded.found.values
    if strength > 0:
        found = loaded.found
        values = refine(loaded.photo.pixels, values, strength, found.unknown, is_enlarged=found.is_enlarged)
    canvas = DepthCanvas(loaded.photo.pixels, values)
    return replace(loaded, refined=replace(loaded.found, values=values), levels=levels_of(values), canvas=canvas)
