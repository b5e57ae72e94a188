"""Pictures and maps of the window's scene, to files and to the clipboard: what is asked for becomes a job."""

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
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.images.picture_kinds import AS_USUAL, PictureFormat, is_float
from iibr_core.formats.outputs import AlreadyThereError, make_folder
from iibr_core.runtime.work import report_progress
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError
from viewer.app.clipboard import copied_path, copy_picture
from viewer.app.image_export import SavedShot, export_map, export_picture, shot_of
from viewer.app.job import Job, Needs
from viewer.app.job_queue import JobQueue
from viewer.app.save_places import map_path, picture_path
from viewer.background.job_threads import message_of
from viewer.model import messages, preferences
from viewer.model.action import Action, do
from viewer.model.state.app_state import AppState
from viewer.model.state.jobs import WRITING
from viewer.model.state.notices import Notice
from viewer.model.state.prompts import SavePrompt
from viewer.model.state.tasks import SaveTask

NO_MAP = "a light field has no depth map of its own to save"


@dataclass(frozen=True, eq=False)
class _Shot:
    """A picture as it was asked for. is_free: of a free camera, which the photo at its own size cannot show."""

    path: Path
    size: ScreenSize
    form: PictureFormat
    state: AppState
    is_copied: bool = False

    @property
    def is_free(self) -> bool:
        return self.state.free_camera is not None

    def is_full(self, scene: Scene, optics: Optics) -> bool:
        """Whether it is drawn from the photo at its own size, and from the views only what that needs of them."""
        return not (self.is_free or self.is_copied) and is_full(scene, optics, self.size)

    def needs(self, scene: Scene, optics: Optics) -> Needs:
        """What is copied, and what a free camera sees, is what is seen."""
        if self.is_copied or self.is_free:
            return "shown"
        return "scene" if self.is_full(scene, optics) else "views"

    def saved_of(self, optics: Optics) -> SavedShot:
        """What the file says of it."""
        shot = shot_of(self.state, self.size, self.form)
        return replace(shot, settings=replace(shot.settings, optics=optics))


def add_save(task: SaveTask, state: AppState, inputs: Sequence[Path], jobs: JobQueue) -> list[Action]:
    """Save the present picture, or its map; says so where that cannot be. inputs: what is read."""
    if state.scene is None:
        return []
    try:
        path = (map_path if task.what == "map" else picture_path)(task, inputs)
        if task.what == "map" and state.scene.plan is None:
            raise InputError(f"{path}: {NO_MAP}")
        if not task.may_replace and jobs.writes(path):
            raise AlreadyThereError(f"{path}: is about to be written")
    except AlreadyThereError:
        prompt = SavePrompt(task.path, task.size_px, already_there=True, what=task.what, form=task.form)
        return [do(messages.show_prompt, prompt)]
    except InputError as error:
        return [_refusal(task, state, error)]
    if task.what == "map":
        jobs.add(Job("map", path, state, lambda scene, optics: "scene", partial(_save_map, path, state)))
    else:
        shot = _Shot(path, task.size_px, task.form, state)
        jobs.add(Job("picture", path, state, shot.needs, partial(_save, shot), takes_part=True))
    closed: list[Action] = [do(messages.show_prompt, None)] if isinstance(state.prompt, SavePrompt) else []
    return closed if task.what == "map" else [*closed, do(preferences.set_last_folder, os.path.abspath(path.parent))]


def add_copy(state: AppState, jobs: JobQueue) -> list[Action]:
    """Put the present picture into the clipboard, at the size of the views."""
    if state.scene is None:
        return [do(messages.notify, Notice("There is no picture to copy yet: open a photo."))]
    shot = _Shot(copied_path(), state.scene.size, AS_USUAL, state, is_copied=True)
    jobs.add(Job("copy", shot.path, state, shot.needs, partial(_copy, shot)))
    return []


def _refusal(task: SaveTask, state: AppState, error: InputError) -> Action:
    """Why nothing is saved: where it was asked for, whatever was typed there stays; else in a notice."""
    if isinstance(state.prompt, SavePrompt):
        return do(
            messages.show_prompt,
            SavePrompt(task.path, task.size_px, what=task.what, problem=str(error), form=task.form),
        )
    return do(messages.notify, Notice(str(error), is_error=True))


def _save(shot: _Shot, source: ExportSource) -> list[Action]:
    saved = shot.saved_of(source.optics)
    pixels = _drawn(shot, saved, source)
    report_progress(1, 1, WRITING)
    path = export_picture(shot.path, pixels, saved)
    return [do(messages.notify, Notice(f"Saved {path}", stays=True))]


def _copy(shot: _Shot, source: ExportSource) -> list[Action]:
    saved = shot.saved_of(source.optics)
    pixels = _drawn(shot, saved, source)
    make_folder(shot.path.parent)
    copy_picture(export_picture(shot.path, pixels, saved))
    return [do(messages.notify, Notice("Copied the picture."))]


def _save_map(path: Path, state: AppState, source: ExportSource) -> list[Action]:
    """The disparity map, edits included, in px per view step as given."""
    if source.loaded is None:
        raise InputError(f"{path}: {NO_MAP}")
    report_progress(1, 1, WRITING)
    return [do(messages.notify, Notice(export_map(path, source.loaded.disparity.values)))]


def _drawn(shot: _Shot, saved: SavedShot, source: ExportSource) -> NDArray[Any]:
    """(H, W, 3), bytes, or linear light where the file holds that. Raises InputError, with the file's name."""
    is_linear, space = is_float(shot.path, shot.form), saved.color_space
    try:
        if shot.is_full(source.scene, source.optics):
            return _drawn_full(shot, source, is_linear, saved)
        return source.draw(RenderSettings(source.optics, shot.size, is_linear=is_linear, color_space=space))
    except (InputError, MemoryError) as error:
        raise InputError(f"{shot.path}: not saved. {message_of(error)}") from error


def _drawn_full(shot: _Shot, source: ExportSource, is_linear: bool, saved: SavedShot) -> NDArray[Any]:
    """At the photo's own size."""
    scene = source.scene
    assert scene.plan is not None
    assert source.loaded is not None
    from iibr_core.exports.full_drawing import draw_full

    full = FullPicture(scene, scene.plan, source.loaded, source.optics, shot.size)
    light = draw_full(full, source.draw)
    return encode_light(light, is_linear, saved.color_space, scene.color_space)
