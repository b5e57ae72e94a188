"""Writing the picture with its settings inside, so that it can be taken again."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from iibr_core.color import srgb_from_linear
from iibr_core.types import InputError
from viewer.display.scene_view import SceneView
from viewer.model.saved_settings import ATTRIBUTE, settings_text
from viewer.model.state.app_state import AppState, SavedSettings, SaveTask

SUFFIXES = (".png", ".exr")
MAX_PIXELS = 100_000_000
"""Of a picture: as float light it then takes 1.2 GB."""


class AlreadyThereError(InputError):
    """A file of this name exists, and nobody said that it may go."""


def settings_of(state: AppState, size_px: tuple[int, int]) -> SavedSettings:
    """What it takes to take the present picture again. size_px: (width, height)."""
    assert state.source is not None
    source = replace(state.source, path="", disparity_path=None, refine=state.depth.refine)
    return SavedSettings(state.optics, state.depth_strength, source, size_px, state.depth.edits)


def save_map(scene_view: SceneView, task: SaveTask) -> str:
    """Write the disparity map of the scene on the screen, edits included, in px per view step as given.

    Returns a sentence for people. Raises AlreadyThereError, and InputError as `write_map` does and where there is none.
    """
    from iibr_core.formats.maps.writer import write_map

    path = _path_of(task, ".pfm")
    if scene_view.loaded is None:
        raise InputError(f"{path}: this scene has no disparity map of its own")
    _require_leave(path, task)
    note = write_map(path, scene_view.loaded.disparity.values)
    return f"Saved {path}. {note}".strip()


def _path_of(task: SaveTask, suffix: str) -> Path:
    """The path asked for; with this suffix where it has none."""
    path = Path(task.path.strip()).expanduser()
    if not path.name:
        raise InputError(f"no file name was given: write one that ends in {suffix}")
    return path if path.suffix else path.with_name(f"{path.name}{suffix}")


def _require_leave(path: Path, task: SaveTask) -> None:
    if path.exists() and not task.may_replace:
        raise AlreadyThereError(f"{path}: there is a file of this name already")


def save_picture(scene_view: SceneView, state: AppState, task: SaveTask) -> Path:
    """Draw the picture in the size asked for and write it; returns the path written.

    Raises AlreadyThereError, and InputError for other endings, sizes beyond the graphics card, and unwritable places.
    """
    path = _path_of(task, ".png")
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: can be written as .png or .exr only")
    _require_leave(path, task)
    write_picture(path, render_pixels(scene_view, state, task.size_px, is_float(path)), state, task.size_px)
    return path


def is_float(path: Path) -> bool:
    """Whether files of this kind hold more than 8 bits a channel."""
    return path.suffix.lower() == ".exr"


def write_picture(path: Path, pixels: NDArray[Any], state: AppState, size_px: tuple[int, int]) -> None:
    """Write sRGB-encoded pixels, uint8 or float, with the settings of the state inside. Raises InputError."""
    from iibr_core.formats.images.photo import write_image

    write_image(path, pixels, {ATTRIBUTE: settings_text(settings_of(state, size_px))})


def render_pixels(
    scene_view: SceneView, state: AppState, size_px: tuple[int, int], as_float: bool = False
) -> NDArray[Any]:
    """The picture with every sample it will get, (height, width, 3), sRGB-encoded: uint8, or float32 with 1 = white.

    Larger pictures than the graphics card can hold are drawn in parts. Raises InputError beyond MAX_PIXELS.
    """
    width, height = size_px
    if min(size_px) < 1 or width * height > MAX_PIXELS:
        raise InputError(f"{width}x{height} px: a picture may have 1 to {MAX_PIXELS // 10**6} million pixels")
    pixels = scene_view.picture(state, size_px, is_linear=as_float)
    return srgb_from_linear(pixels) if as_float else pixels
