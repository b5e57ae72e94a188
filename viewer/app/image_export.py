"""Pictures and maps on their way to a file, from the window and the command line."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from iibr_core.formats.images.picture_kinds import PictureFormat
from iibr_core.formats.images.write import write_picture
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace, FloatImage
from viewer.model.state.app_state import AppState
from viewer.model.state.saving import SavedSettings


@dataclass(frozen=True, eq=False)
class SavedShot:
    """A picture to be saved. form: how. color_space: of its colours. photo: whose file tells more, None without."""

    settings: SavedSettings
    form: PictureFormat
    color_space: ColorSpace
    photo: Path | None


def export_image(path: Path, pixels: NDArray[Any]) -> None:
    """Write sRGB bytes (H, W, 3), whole or not at all. Raises InputError where that cannot be."""
    write_picture(path, pixels)


def export_picture(path: Path, drawn: NDArray[Any], shot: SavedShot) -> Path:
    """Write a picture as it was drawn: (H, W, 3), bytes, or linear light, see `is_float`; returns the path.

    What it takes to take it again is put inside, and what the photo's file says of the photo. Raises InputError.
    """
    from iibr_core.formats.images.metadata import SETTINGS_KEY, PictureMetadata, read_metadata
    from viewer.model.saved_settings import settings_text

    of_photo = PictureMetadata() if shot.photo is None else read_metadata(shot.photo)
    texts = {SETTINGS_KEY: settings_text(shot.settings)}
    metadata = PictureMetadata(of_photo.exif, of_photo.xmp, texts)
    write_picture(path, drawn, shot.form, metadata, shot.color_space)
    return path


def export_map(path: Path, values: FloatImage) -> str:
    """Write a disparity map (H, W); returns a sentence for people. Raises InputError as `write_map` does."""
    from iibr_core.formats.maps.writer import write_map

    return f"Saved {path}. {write_map(path, values)}".strip()


def settings_of(state: AppState, size_px: ScreenSize) -> SavedSettings:
    """What it takes to take the present picture again. size_px: (width, height)."""
    assert state.source is not None
    source = replace(state.source, path="", depth=replace(state.source.depth, file=None, refine=state.depth.refine))
    scene = state.scene
    return SavedSettings(
        state.optics,
        state.depth_strength,
        source,
        size_px,
        state.depth.edits,
        has_model_depth=scene is not None and scene.has_model_depth,
        view_width=scene.width if scene is not None else None,
    )


def shot_of(state: AppState, size_px: ScreenSize, form: PictureFormat) -> SavedShot:
    """The present picture, to be saved so."""
    assert state.source is not None
    space = SRGB if state.scene is None else state.scene.color_space
    photo = Path(state.source.path)
    return SavedShot(settings_of(state, size_px), form, form.space_for(space), None if photo.is_dir() else photo)
