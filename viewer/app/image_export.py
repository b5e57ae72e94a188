"""Images on their way to a file, from the window and the command line: `export_image` writes every one of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from iibr_core.color import srgb_from_linear
from iibr_core.formats.files import require_folder_of
from iibr_core.types import FloatImage, InputError
from viewer.display.scene_view import SceneView
from viewer.model.layout import ScreenSize
from viewer.model.state.app_state import AppState, SavedSettings, SaveTask

SUFFIXES = (".png", ".exr")
MAX_PIXELS = 100_000_000
"""Of a picture: as float light it then takes 1.2 GB."""


class AlreadyThereError(InputError):
    """A file of this name exists, and nobody said that it may go."""


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


def picture_path(task: SaveTask) -> Path:
    """Where this picture goes, found out before it is drawn, which may take minutes.

    Raises AlreadyThereError, and InputError for other endings, sizes beyond MAX_PIXELS, and missing folders.
    """
    path = _path_of(task, ".png")
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: can be written as .png or .exr only")
    _require_size(task.size_px)
    require_folder_of(path)
    _require_leave(path, task)
    return path


def map_path(task: SaveTask) -> Path:
    """Where this disparity map goes. Raises AlreadyThereError, and InputError without a name."""
    path = _path_of(task, ".pfm")
    _require_leave(path, task)
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
    path = Path(task.path.strip()).expanduser()
    if not path.name:
        raise InputError(f"no file name was given: write one that ends in {suffix}")
    return path if path.suffix else path.with_name(f"{path.name}{suffix}")


def _require_size(size_px: ScreenSize) -> None:
    width, height = size_px
    if min(size_px) < 1 or width * height > MAX_PIXELS:
        raise InputError(f"{width}x{height} px: a picture may have 1 to {MAX_PIXELS // 10**6} million pixels")


def _require_leave(path: Path, task: SaveTask) -> None:
    if path.exists() and not task.may_replace:
        raise AlreadyThereError(f"{path}: there is a file of this name already")
