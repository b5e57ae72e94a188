"""Places and contents of saved pictures, for the window and the command line. Quick to import."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from iibr_core.exports.render_settings import require_size
from iibr_core.formats.images.picture_kinds import AS_USUAL, PictureFormat, require_picture_format
from iibr_core.formats.outputs import check_output
from iibr_core.scenes.inputs import inputs_of, named_by
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace, ImageSize, InputError
from viewer.model.app_state import AppState
from viewer.model.saving import SavedSettings, settings_of


@dataclass(frozen=True, eq=False)
class SavedShot:
    """Contents of a saved picture beside its pixels. photo: file whose metadata is copied, None without one."""

    settings: SavedSettings
    form: PictureFormat
    color_space: ColorSpace
    photo: Path | None


def shot_of(state: AppState, size_px: ScreenSize, form: PictureFormat) -> SavedShot:
    """Return what a file stores of the present picture."""
    assert state.source is not None
    space = SRGB if state.scene is None else state.scene.color_space
    photo = Path(state.source.path)
    return SavedShot(settings_of(state, size_px), form, form.space_for(space), None if photo.is_dir() else photo)


def export_picture(path: Path, drawn: NDArray[Any], shot: SavedShot) -> Path:
    """Write a drawn picture, (H, W, 3), bytes or linear light (see `is_float`), with its settings and metadata.

    Return the path. Raises InputError.
    """
    from iibr_core.formats.images.metadata import SETTINGS_KEY, PictureMetadata
    from iibr_core.formats.images.open_picture import read_metadata
    from iibr_core.formats.images.write import write_picture
    from viewer.model.saved_settings import settings_text

    of_photo = PictureMetadata() if shot.photo is None else read_metadata(shot.photo)
    metadata = PictureMetadata(of_photo.exif, of_photo.xmp, {SETTINGS_KEY: settings_text(shot.settings)})
    write_picture(path, drawn, shot.form, metadata, shot.color_space)
    return path


def read_settings(path: Path) -> SavedSettings:
    """Return the settings that a picture was saved with. Raises InputError if there are none, or damaged ones."""
    from iibr_core.formats.images.open_picture import settings_text_in
    from viewer.model.saved_settings import settings_from_text

    text = settings_text_in(path)
    if not text:
        raise InputError(f"{path}: holds no settings of iibr; give a picture saved with Ctrl+S or `iibr screenshot`")
    return settings_from_text(text, str(path))


def inputs_of_scene(state: AppState) -> tuple[Path, ...]:
    """Return the files that are read for the open scene and for the one that is being opened."""
    sources = [about.source for about in (state, state.scene) if about is not None and about.source is not None]
    is_open = state.scene is not None and state.scene.source == state.source  # then its map is known
    origin = state.scene.depth_origin if state.scene is not None else None
    found = tuple(path for source in sources for path in (named_by(source) if is_open else inputs_of(source)))
    return (*found, Path(os.path.expanduser(origin.file))) if origin is not None and origin.file else found


def require_picture_place(
    path: Path,
    size_px: ScreenSize | None,
    inputs: Sequence[Path],
    may_replace: bool,
    form: PictureFormat = AS_USUAL,
) -> None:
    """Check, before a picture is drawn, that it can be written. inputs: files that are read.

    Raises AlreadyThereError, and InputError for a wrong format or size, and as `check_output` does.
    """
    if size_px is not None:
        require_size(size_px)
    require_picture_format(path, form, None if size_px is None else ImageSize(size_px[1], size_px[0]))
    check_output(path, inputs, may_replace)
