"""Images on their way to a file, from the window and the command line: where they may go, and `export_image`, which
writes every one of them.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from iibr_core.color import srgb_from_linear
from iibr_core.formats.files import status_of
from iibr_core.formats.outputs import require_file_place
from iibr_core.types import FloatImage, InputError
from viewer.display.scene_view import SceneView
from viewer.model.layout import ScreenSize
from viewer.model.state.app_state import AppState, SavedSettings, SaveTask, Source

SUFFIXES = (".png", ".exr")
MAX_PIXELS = 100_000_000
"""Of a picture: as float light it then takes 1.2 GB."""


def export_image(path: Path, pixels: NDArray[Any], settings: SavedSettings | None = None) -> None:
    """Write an sRGB-encoded image (H, W, 3), uint8 or float with 1 = white, whole or not at all.

    settings: what it takes to take the picture again, put inside. Raises InputError where it cannot be written.
    """
    from iibr_core.formats.images.photo import write_image

    if settings is None:
        write_image(path, pixels)
        return
    from viewer.model.saved_settings import ATTRIBUTE, settings_text

    write_image(path, pixels, {ATTRIBUTE: settings_text(settings)})


def export_picture(path: Path, drawn: NDArray[Any], settings: SavedSettings) -> Path:
    """Write a picture as the graphics card drew it, see `is_float`; returns the path. Raises InputError."""
    export_image(path, srgb_from_linear(drawn) if is_float(path) else drawn, settings)
    return path


def export_map(path: Path, values: FloatImage) -> str:
    """Write a disparity map (H, W); returns a sentence for people. Raises InputError as `write_map` does."""
    from iibr_core.formats.maps.writer import write_map

    return f"Saved {path}. {write_map(path, values)}".strip()


def settings_of(state: AppState, size_px: ScreenSize) -> SavedSettings:
    """What it takes to take the present picture again. size_px: (width, height)."""
    assert state.source is not None
    source = replace(state.source, path="", depth=replace(state.source.depth, file=None, refine=state.depth.refine))
    return SavedSettings(state.optics, state.depth_strength, source, size_px, state.depth.edits)


def inputs_of(source: Source) -> tuple[Path, ...]:
    """What is read to open it, as far as it is named: nothing may be written there. See `require_file_place`."""
    model = None if source.depth.model is None else os.path.expanduser(source.depth.model)
    is_model_path = model is not None and status_of(Path(model)) is not None  # else it is a name
    return tuple(Path(path) for path in (source.path, source.depth.file, model if is_model_path else None) if path)


def inputs_of_scene(state: AppState) -> tuple[Path, ...]:
    """What is read for what is open, for what is being opened, and to compare with."""
    sources = [about.source for about in (state, state.scene) if about is not None and about.source is not None]
    origin = state.scene.depth_origin if state.scene is not None else None
    beside = (origin.file if origin is not None else None, state.inspection.truth and state.inspection.truth.path)
    found = [path for source in sources for path in inputs_of(source)]
    return (*found, *(Path(os.path.expanduser(path)) for path in beside if path))


def require_picture_place(path: Path, size_px: ScreenSize | None, inputs: Sequence[Path], may_replace: bool) -> None:
    """Find out before a picture is drawn, which may take minutes, whether it can be written. inputs: what is read.

    Raises AlreadyThereError, and InputError for other endings, sizes beyond MAX_PIXELS, and as `require_file_place`.
    """
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: can be written as .png or .exr only")
    if size_px is not None:
        _require_size(size_px)
    require_file_place(path, inputs, may_replace)


def picture_path(task: SaveTask, inputs: Sequence[Path]) -> Path:
    """Where this picture goes. Raises as `require_picture_place` does, and InputError without a name."""
    path = _path_of(task, ".png")
    require_picture_place(path, task.size_px, inputs, task.may_replace)
    return path


def map_path(task: SaveTask, inputs: Sequence[Path]) -> Path:
    """Where this disparity map goes. Raises as `require_file_place` does, and InputError without a name."""
    path = _path_of(task, ".pfm")
    require_file_place(path, inputs, task.may_replace)
    return path


def is_float(path: Path) -> bool:
    """Whether files of this kind hold more than 8 bits a channel: their pictures are drawn as linear light."""
    return path.suffix.lower() == ".exr"


def render_pixels(scene_view: SceneView, state: AppState, size_px: ScreenSize, as_float: bool = False) -> NDArray[Any]:
    """The picture with every sample it will get, (height, width, 3), sRGB-encoded: uint8, or float32 with 1 = white.

    Larger pictures than the graphics card can hold are drawn in parts. Raises InputError beyond MAX_PIXELS.
    """
    _require_size(size_px)
    pixels = scene_view.picture(state, size_px, is_linear=as_float)
    return srgb_from_linear(pixels) if as_float else pixels


def _path_of(task: SaveTask, suffix: str) -> Path:
    """The path asked for; with this suffix where it has none."""
    path = Path(os.path.expanduser(task.path.strip()))
    if not path.name:
        raise InputError(f"no file name was given: write one that ends in {suffix}")
    return path if path.suffix else path.with_name(f"{path.name}{suffix}")


def _require_size(size_px: ScreenSize) -> None:
    width, height = size_px
    if min(size_px) < 1 or width * height > MAX_PIXELS:
        raise InputError(f"{width}x{height} px: a picture may have 1 to {MAX_PIXELS // 10**6} million pixels")
