"""Images on their way to a file, from the window and the command line: `export_image` writes every one of them."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from iibr_core.color import srgb_from_linear
from iibr_core.types import FloatImage
from viewer.app.save_places import require_size
from viewer.display.scene_view import SceneView
from viewer.model.layout import ScreenSize
from viewer.model.state.app_state import AppState, SavedSettings


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


def is_float(path: Path) -> bool:
    """Whether files of this kind hold more than 8 bits a channel: their pictures are drawn as linear light."""
    return path.suffix.lower() == ".exr"


def render_pixels(scene_view: SceneView, state: AppState, size_px: ScreenSize, as_float: bool = False) -> NDArray[Any]:
    """The picture with every sample it will get, (height, width, 3), sRGB-encoded: uint8, or float32 with 1 = white.

    Larger pictures than the graphics card can hold are drawn in parts. Raises InputError beyond MAX_PIXELS.
    """
    require_size(size_px)
    pixels = scene_view.picture(state.optics, size_px, is_linear=as_float)
    return srgb_from_linear(pixels) if as_float else pixels
