"""Saves, copies and exports of the window's scene: check a task and make it a job."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from iibr_core.beyond.optics import Optics
from iibr_core.exports.full_picture import FullPicture, encode_light, is_full
from iibr_core.exports.kinds import ExportKind, export_kind, optics_of, require_export_place
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource, write_export
from iibr_core.formats.images.picture_kinds import AS_USUAL, PictureFormat, is_float
from iibr_core.formats.outputs import AlreadyThereError, check_output, make_folder
from iibr_core.runtime.extras import require_extra
from iibr_core.runtime.work import report_progress
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError
from viewer.app.clipboard import copied_path, copy_picture
from viewer.app.jobs import Job, Jobs, Needs
from viewer.app.picture_files import SavedShot, export_picture, require_picture_place, shot_of
from viewer.background.newest import message_of
from viewer.model import messages, saving
from viewer.model.action import Action, do
from viewer.model.remedies import words_of
from viewer.model.state.app_state import AppState
from viewer.model.state.jobs import WRITING
from viewer.model.state.notices import Notice
from viewer.model.state.prompts import ExportPrompt
from viewer.model.state.tasks import ExportTask, SaveTask
from viewer.model.viewpoint import clicked_rack

OPEN_PHOTO = "This is the open photo. Choose another name."
NO_MAP = "a light field has no depth map to save"


@dataclass(frozen=True, eq=False)
class _Shot:
    """A picture as it was asked for."""

    path: Path
    size: ScreenSize
    form: PictureFormat
    state: AppState
    is_copied: bool = False

    def is_full(self, scene: Scene, optics: Optics) -> bool:
        """Return whether it is drawn from the photo at its own size, which a free camera cannot do."""
        return not (self.state.free_camera or self.is_copied) and is_full(scene, optics, self.size)

    def needs(self, scene: Scene, optics: Optics) -> Needs:
        """Return what it needs of the scene: a copy, and a free camera's picture, show what the window shows."""
        if self.is_copied or self.state.free_camera:
            return "shown"
        return "photo" if self.is_full(scene, optics) else "views"


def add_save(task: SaveTask, state: AppState, inputs: Sequence[Path], jobs: Jobs) -> list[Action]:
    """Save the present picture or its depth map; show the prompt with the reason if that is not possible.

    inputs: files that are read.
    """
    prompt = task.prompt
    if state.scene is None:
        return []
    try:
        path = checked_path(task, inputs)
        if prompt.what == "map" and state.scene.plan is None:
            raise InputError(f"{path}: {NO_MAP}")
        if not task.may_replace and jobs.writes(path):
            raise AlreadyThereError(f"{path}: is being written")
    except AlreadyThereError:
        return [do(messages.show_prompt, replace(prompt, already_there=True, problem=""))]
    except InputError as error:
        return [do(messages.show_prompt, replace(prompt, already_there=False, problem=words_of(error)))]
    if prompt.what == "map":
        jobs.add(Job("map", path, state, partial(_save_map, path), lambda scene, optics: "photo"))
        return [do(messages.show_prompt, None)]
    shot = _Shot(path, prompt.size_px, prompt.form, state)
    jobs.add(Job("picture", path, state, partial(_save, shot), shot.needs))
    return [do(saving.begin_job, Path(os.path.abspath(path)))]


def checked_path(task: SaveTask, inputs: Sequence[Path]) -> Path:
    """Return the path to write. inputs: files that are read, the open photo first.

    Raises AlreadyThereError, and InputError if it cannot be written.
    """
    prompt = task.prompt
    path = _with_ending(prompt.path, ".pfm" if prompt.what == "map" else ".png")
    _require_another(path, inputs)
    if prompt.what == "map":
        check_output(path, inputs, task.may_replace)
    else:
        require_picture_place(path, prompt.size_px, inputs, task.may_replace, prompt.form)
    return path


def add_copy(state: AppState, jobs: Jobs) -> list[Action]:
    """Put the present picture into the clipboard, at the size of the views."""
    if state.scene is None:
        return [do(messages.notify, Notice("There is no picture to copy yet. Open a photo first."))]
    shot = _Shot(copied_path(), state.scene.size, AS_USUAL, state, is_copied=True)
    jobs.add(Job("copy", shot.path, state, partial(_copy, shot), shot.needs))
    return []


def add_export(task: ExportTask, state: AppState, inputs: Sequence[Path], jobs: Jobs) -> list[Action]:
    """Export the present scene; show the prompt with the reason if that is not possible.

    inputs: files that are read.
    """
    prompt = task.prompt
    if state.scene is None:
        return []
    try:
        kind = export_kind(prompt.kind)
        path = saving.written_path(kind, os.path.expanduser(prompt.path.strip()), state.scene, prompt.options)
        _require_another(path, inputs)
        require_export_place(kind, path, inputs, task.may_replace)
        if kind.needs:
            require_extra("export", *kind.needs)
        if jobs.writes(path):
            raise InputError(f"{path} is being written by another export. Choose another name.")
    except AlreadyThereError:
        return [do(messages.show_prompt, replace(prompt, already_there=True, problem=""))]
    except InputError as error:
        return [do(messages.show_prompt, replace(prompt, already_there=False, problem=words_of(error)))]
    prompt = replace(prompt, options=replace(prompt.options, rack=clicked_rack(state)))
    work, pictures = partial(_export, kind, path, prompt), partial(optics_of, kind, prompt.options)
    jobs.add(Job("export", path, state, work, pictures=pictures, prompt=prompt))
    return [do(saving.begin_job, Path(os.path.abspath(path)), prompt)]


def _require_another(path: Path, inputs: Sequence[Path]) -> None:
    if inputs and path.exists() and inputs[0].exists() and path.samefile(inputs[0]):
        raise InputError(OPEN_PHOTO)


def _save(shot: _Shot, source: ExportSource) -> list[Action]:
    saved = _saved_of(shot, source.optics)
    pixels = _drawn(shot, saved, source)
    report_progress(1, 1, WRITING)
    path = export_picture(shot.path, pixels, saved)
    return [do(saving.finish_job, path)]


def _copy(shot: _Shot, source: ExportSource) -> list[Action]:
    saved = _saved_of(shot, source.optics)
    pixels = _drawn(shot, saved, source)
    make_folder(shot.path.parent)
    copy_picture(export_picture(shot.path, pixels, saved))
    return [do(messages.notify, Notice("Copied the picture.", is_result=True))]


def _save_map(path: Path, source: ExportSource) -> list[Action]:
    """Save the disparity map with its edits, in pixels per view step as given."""
    from iibr_core.formats.maps.writer import write_map

    if source.loaded is None:
        raise InputError(f"{path}: {NO_MAP}")
    report_progress(1, 1, WRITING)
    message = write_map(path, source.loaded.disparity.values)
    return [do(saving.finish_job, path, message)]


def _export(kind: ExportKind, path: Path, prompt: ExportPrompt, source: ExportSource) -> list[Action]:
    message = write_export(kind, path, source, prompt.options)
    return [do(saving.finish_job, path, message or "", prompt)]


def _saved_of(shot: _Shot, optics: Optics) -> SavedShot:
    saved = shot_of(shot.state, shot.size, shot.form)
    return replace(saved, settings=replace(saved.settings, optics=optics))


def _drawn(shot: _Shot, saved: SavedShot, source: ExportSource) -> NDArray[Any]:
    """Return the picture, (H, W, 3), bytes or linear light. Raises InputError with the file's name."""
    is_linear, space = is_float(shot.path, shot.form), saved.color_space
    try:
        if shot.is_full(source.scene, source.optics):
            return _drawn_full(shot, source, is_linear, saved)
        return source.draw(RenderSettings(source.optics, shot.size, is_linear=is_linear, color_space=space))
    except (InputError, MemoryError) as error:
        raise InputError(f"{shot.path}: not saved. {message_of(error)}") from error


def _drawn_full(shot: _Shot, source: ExportSource, is_linear: bool, saved: SavedShot) -> NDArray[Any]:
    from iibr_core.exports.full_drawing import draw_full

    scene = source.scene
    assert scene.plan is not None
    assert source.loaded is not None
    full = FullPicture(scene, scene.plan, source.loaded, source.optics, shot.size)
    light = draw_full(full, source.draw)
    return encode_light(light, is_linear, saved.color_space, scene.color_space)


def _with_ending(typed: str, ending: str) -> Path:
    """Return the typed path, with an ending if it has none. Raises InputError without a name."""
    path = Path(os.path.expanduser(typed.strip()))
    if not path.name:
        raise InputError("There is no name yet. Type one, or press Browse…")
    return path if path.suffix else path.with_name(f"{path.name}{ending}")
