"""Where pictures and maps may be saved, from the window and the command line: never onto what is read. Light, so that
it can be asked before anything is loaded.
"""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

from iibr_core.exports.render_settings import require_size
from iibr_core.formats.images.picture_kinds import AS_USUAL, PictureFormat, require_picture_format
from iibr_core.formats.outputs import check_output
from iibr_core.scenes.inputs import inputs_of, named_by
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ImageSize, InputError
from viewer.model.state.app_state import AppState
from viewer.model.state.tasks import SaveTask


def inputs_of_scene(state: AppState) -> tuple[Path, ...]:
    """Return the files of the scene that is open, and of one that is being opened."""
    sources = [about.source for about in (state, state.scene) if about is not None and about.source is not None]
    is_open = state.scene is not None and state.scene.source == state.source  # then its map is known
    origin = state.scene.depth_origin if state.scene is not None else None
    beside = (origin and origin.file,)
    found = [path for source in sources for path in (named_by(source) if is_open else inputs_of(source))]
    return (*found, *(Path(os.path.expanduser(path)) for path in beside if path))


def require_picture_place(
    path: Path,
    size_px: ScreenSize | None,
    inputs: Sequence[Path],
    may_replace: bool,
    form: PictureFormat = AS_USUAL,
) -> None:
    """Find out before a picture is drawn, which may take minutes, whether it can be written. inputs: what is read.

    Raises AlreadyThereError, and InputError for what its kind of file does not have, sizes beyond MAX_PIXELS, and as
    `check_output`.
    """
    if size_px is not None:
        require_size(size_px)
    require_picture_format(path, form, None if size_px is None else ImageSize(size_px[1], size_px[0]))
    check_output(path, inputs, may_replace)


def picture_path(task: SaveTask, inputs: Sequence[Path]) -> Path:
    """Where this picture goes. Raises as `require_picture_place` does, and InputError without a name."""
    path = _path_of(task, ".png")
    require_picture_place(path, task.size_px, inputs, task.may_replace, task.form)
    return path


def map_path(task: SaveTask, inputs: Sequence[Path]) -> Path:
    """Where this disparity map goes. Raises as `check_output` does, and InputError without a name."""
    path = _path_of(task, ".pfm")
    check_output(path, inputs, task.may_replace)
    return path


def _path_of(task: SaveTask, suffix: str) -> Path:
    """The path asked for; with this suffix where it has none."""
    path = Path(os.path.expanduser(task.path.strip()))
    if not path.name:
        raise InputError(f"There is no name yet: type one that ends in {suffix}, or press Browse…")
    return path if path.suffix else path.with_name(f"{path.name}{suffix}")
