"""Saves, copies and exports of the window's scene: check a task and make it a job."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

from iibr_core.beyond.optics import Optics
from iibr_core.exports.full_picture import is_full
from iibr_core.exports.kinds import ExportKind, export_kind, optics_of, require_export_place
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource, write_export
from iibr_core.formats.images.picture_kinds import AS_USUAL, is_float
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
from viewer.model.app_state import AppState
from viewer.model.messages import Notice
from viewer.model.remedies import words_of
from viewer.model.saving import WRITING, ExportPrompt, SavePrompt
from viewer.model.tasks import SaveTask
from viewer.model.viewpoint import clicked_rack

OPEN_PHOTO = "This is the open photo. Choose another name."
NO_MAP = "a light field has no depth map to save"


def add_file(task: SaveTask, state: AppState, inputs: Sequence[Path], jobs: Jobs) -> list[Action]:
    """Save the picture or its depth map, or export the scene; show the prompt with the reason if that is not possible,
    or with the question whether to replace the file.

    inputs: files that are read.
    """
    if state.scene is None:
        return []
    prompt = saving.in_usual_folder(state, task.prompt)
    try:
        if isinstance(prompt, ExportPrompt):
            job = _export_job(prompt, task.may_replace, state, state.scene, inputs)
        else:
            job = _save_job(prompt, task.may_replace, state, state.scene, inputs)
        if jobs.writes(job.path) and not task.may_replace:
            raise AlreadyThereError(f"{job.path}: is being written")
    except InputError as error:
        there = isinstance(error, AlreadyThereError)
        problem = "" if there else words_of(error)
        return [do(messages.show_prompt, replace(prompt, already_there=there, problem=problem))]
    jobs.add(job, state.scene)
    return [do(messages.show_prompt, None) if job.kind == "map" else do(saving.begin_job, job.path, job.prompt)]


def add_copy(state: AppState, jobs: Jobs) -> list[Action]:
    """Put the present picture into the clipboard, at the size of the views."""
    if state.scene is None:
        return [do(messages.notify, Notice("There is no picture to copy yet. Open a photo first."))]
    path, shot = copied_path(), shot_of(state, state.scene.size, AS_USUAL)
    needs = partial(_needs, state.scene.size, True)
    jobs.add(Job("copy", path, state, partial(_copy, path, shot), needs), state.scene)
    return []


def _save_job(prompt: SavePrompt, may_replace: bool, state: AppState, scene: Scene, inputs: Sequence[Path]) -> Job:
    path = checked_path(prompt, may_replace, inputs)
    if prompt.what == "map":
        if scene.plan is None:
            raise InputError(f"{path}: {NO_MAP}")
        work = partial(_save_map, path, prompt)
        return Job("map", path, state, work, lambda scene, optics: "photo", prompt=prompt)
    is_as_shown, shot = state.free_camera is not None, shot_of(state, prompt.size_px, prompt.form)
    work, needs = partial(_save, path, shot, is_as_shown, prompt), partial(_needs, prompt.size_px, is_as_shown)
    return Job("picture", path, state, work, needs, prompt=prompt)


def checked_path(prompt: SavePrompt, may_replace: bool, inputs: Sequence[Path]) -> Path:
    """Return the path to write, with an ending if the typed one has none. inputs: files that are read, the open photo
    first.

    Raises AlreadyThereError, and InputError if it cannot be written.
    """
    path = Path(os.path.expanduser(prompt.path.strip()))
    if not path.name:
        raise InputError(saving.NO_NAME)
    if not path.suffix:
        path = path.with_name(f"{path.name}{'.pfm' if prompt.what == 'map' else '.png'}")
    _require_another(path, inputs)
    if prompt.what == "map":
        check_output(path, inputs, may_replace)
    else:
        require_picture_place(path, prompt.size_px, inputs, may_replace, prompt.form)
    return path


def _export_job(prompt: ExportPrompt, may_replace: bool, state: AppState, scene: Scene, inputs: Sequence[Path]) -> Job:
    kind = export_kind(prompt.kind)
    path = saving.written_path(kind, prompt.path, scene, prompt.options)
    _require_another(path, inputs)
    require_export_place(kind, path, inputs, may_replace)
    if kind.needs:
        require_extra("export", *kind.needs)
    prompt = replace(prompt, options=replace(prompt.options, rack=clicked_rack(state)))
    work, pictures = partial(_export, kind, path, prompt), partial(optics_of, kind, prompt.options)
    return Job("export", path, state, work, pictures=pictures, prompt=prompt)


def _require_another(path: Path, inputs: Sequence[Path]) -> None:
    if inputs and path.exists() and inputs[0].exists() and path.samefile(inputs[0]):
        raise InputError(OPEN_PHOTO)


def _needs(size: ScreenSize, is_as_shown: bool, scene: Scene, optics: Optics) -> Needs:
    """Return what a picture needs of the scene: a copy, and a free camera's picture, show what the window shows."""
    if is_as_shown:
        return "shown"
    return "photo" if is_full(scene, optics, size) else "views"


# In the threads of the jobs


def _save(path: Path, shot: SavedShot, is_as_shown: bool, prompt: SavePrompt, source: ExportSource) -> list[Action]:
    return [do(saving.finish_job, _write(path, shot, is_as_shown, source), "", prompt)]


def _copy(path: Path, shot: SavedShot, source: ExportSource) -> list[Action]:
    make_folder(path.parent)
    copy_picture(_write(path, shot, True, source))
    return [do(messages.notify, Notice("Copied the picture.", is_result=True))]


def _save_map(path: Path, prompt: SavePrompt, source: ExportSource) -> list[Action]:
    """Save the disparity map with its edits, in pixels per view step as given."""
    from iibr_core.formats.maps.writer import write_map

    if source.loaded is None:
        raise InputError(f"{path}: {NO_MAP}")
    report_progress(1, 1, WRITING)
    return [do(saving.finish_job, path, write_map(path, source.loaded.disparity.values), prompt)]


def _export(kind: ExportKind, path: Path, prompt: ExportPrompt, source: ExportSource) -> list[Action]:
    message = write_export(kind, path, source, prompt.options)
    return [do(saving.finish_job, path, message or "", prompt)]


def _write(path: Path, shot: SavedShot, is_as_shown: bool, source: ExportSource) -> Path:
    """Draw a picture, of the views that the window shows or as its size asks for, and write it. Raises InputError with
    the file's name.
    """
    from iibr_core.exports.full_drawing import draw_picture

    shot = replace(shot, settings=replace(shot.settings, optics=source.optics))
    is_linear, size = is_float(path, shot.form), shot.settings.size_px
    settings = RenderSettings(source.optics, size, is_linear=is_linear, color_space=shot.color_space)
    loaded = None if is_as_shown else source.loaded
    try:
        pixels = draw_picture(source.scene, loaded, settings, source.draw)
    except (InputError, MemoryError) as error:
        raise InputError(f"{path}: not saved. {message_of(error)}") from error
    report_progress(1, 1, WRITING)
    return export_picture(path, pixels, shot)
