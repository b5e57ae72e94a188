"""Carries out tasks of the state (dialogs, files, downloads, jobs) and returns actions."""

from __future__ import annotations

import os
from collections.abc import Callable
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from pathlib import Path

import typer

from iibr_core.exports.photo_folder import list_photos
from iibr_core.formats.outputs import remove_leftovers
from iibr_core.scenes.scene import source_beside
from iibr_core.types import CENTRE
from viewer.app.clipboard import paste_picture
from viewer.app.dialogs import Dialog, ask_for_path, ask_for_place, has_dialogs, list_folder
from viewer.app.jobs import Jobs
from viewer.app.picture_files import inputs_of_scene
from viewer.app.saving import add_copy, add_file
from viewer.background.depth_models import actions_of_download, download, list_models
from viewer.background.newest import Newest, message_of
from viewer.display.scene_view import SceneView
from viewer.model import browsing, depth_models, folder, lens, messages, opening, stereo, tasks
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.browsing import PathPrompt
from viewer.model.commands import action_for_path
from viewer.model.demo_photo import is_ours
from viewer.model.folder import PhotoFacts, set_facts
from viewer.model.messages import Notice
from viewer.model.saving import path_beside
from viewer.model.tasks import ChoiceOf, ask, forget_tasks

SAVE_BUDGET_S = 0.025
"""Time for drawing a picture that is being saved in a turn of the loop, in seconds: about as long as a frame."""


class SideEffects:
    """Begins tasks in the window's thread; files are read and written in other threads."""

    def __init__(self, scene_view: SceneView, wake: Callable[[], None], clipboard_text: Callable[[], str]) -> None:
        """wake: called, in a thread, when there is a result. clipboard_text: returns the clipboard's text or ""."""
        self._wake, self._clipboard_text = wake, clipboard_text
        self._jobs = Jobs(scene_view, wake)
        self._executor = ThreadPoolExecutor(2, "iibr-files")
        self._results: list[Future[Action]] = []
        self._downloads = Newest("iibr-models", download, wake)
        self._masks: list[Path] = []
        self._dialog: Dialog | None = None
        self._scene_view = scene_view

    @property
    def is_waiting(self) -> bool:
        """Whether a dialog is open."""
        return self._dialog is not None

    @property
    def is_drawing(self) -> bool:
        """Whether a picture is being drawn to be saved or exported."""
        return self._jobs.is_drawing

    def advance(self, state: AppState) -> list[Action]:
        """Begin the state's tasks, draw for files, and return the results of earlier tasks."""
        actions: list[Action] = [do(forget_tasks, len(state.tasks))] if state.tasks else []
        actions += self._take_results() + self._take_answer(state)
        while (result := self._downloads.next_result()) is not None:
            actions += actions_of_download(result)
        for task in state.tasks:
            actions += self._begin(task, state)
        return actions + self._jobs.advance(state, SAVE_BUDGET_S)

    def close(self) -> None:
        """Finish the files that are being written; cancel everything else."""
        if self._dialog is not None:
            self._dialog.close()
        self._jobs.close()
        self._downloads.close()
        self._executor.shutdown()

    def _begin(self, task: tasks.Task, state: AppState) -> list[Action]:
        match task:
            case tasks.ChooseTask(what) if not has_dialogs():
                return [do(browsing.edit_path, PathPrompt(what, _folder_beside(state)))]
            case tasks.ChooseTask(what):
                self._dialog = self._dialog or ask_for_path(what, _folder_beside(state))
            case tasks.TakePathTask(prompt):
                return _take_path(prompt, state)
            case tasks.ListTask(prompt):
                self._submit(partial(_list, prompt.what, prompt.folder, _absolute(prompt.folder, state)))
            case tasks.ChoosePlaceTask(prompt):
                self._dialog = self._dialog or ask_for_place(prompt)
            case tasks.PlainTask("read mask", path):
                self._masks.append(Path(os.path.expanduser(path)))
                self._submit(partial(_read_mask, self._masks[-1]))
            case tasks.PlainTask("read facts", path):
                self._submit(partial(_read_facts, path))
            case tasks.PlainTask("find recent"):
                self._submit(partial(_find_recent, state))
            case tasks.PlainTask("list folder", path):
                self._submit(lambda: do(folder.set_photos, path, list_photos(path)))
            case tasks.SaveTask():
                return add_file(task, state, self._inputs(state), self._jobs)
            case tasks.CancelJobTask(id_):
                self._jobs.cancel(id_)
            case tasks.ShowFileTask(path, in_folder):
                typer.launch(path, locate=in_folder)
            case tasks.FocusTask(place):
                return self._focus(place, state)
            case tasks.PlainTask("list models"):
                self._submit(lambda: do(depth_models.set_known, list_models()))
            case tasks.PlainTask("download model", name):
                self._downloads.submit(name)
            case tasks.PlainTask("stop download"):
                self._downloads.cancel()
                return [do(depth_models.set_downloading, None)]
            case tasks.PlainTask("find display"):
                self._submit(_find_display)
            case tasks.PlainTask("copy"):
                return add_copy(state, self._jobs)
            case tasks.PlainTask("paste") if self._jobs.is_copying:
                return [do(ask, task)]  # the copy is not in the clipboard yet
            case tasks.PlainTask("paste"):
                text = self._clipboard_text()  # GLFW answers in the window's thread only
                self._submit(lambda: do(_open, paste_picture(text)))
        return []

    def _focus(self, place: tuple[float, float], state: AppState) -> list[Action]:
        scene = state.scene
        if scene is None:
            return []
        x_px, y_px = ((at + 1) / 2 * length - 0.5 for at, length in zip(place, scene.size))
        disparity = self._scene_view.pick(CENTRE, x_px, y_px)
        return [] if disparity is None else [do(opening.focus_again, place, disparity)]

    def _inputs(self, state: AppState) -> tuple[Path, ...]:
        return (*inputs_of_scene(state), *self._jobs.inputs, *self._masks)

    def _submit(self, work: Callable[[], Action]) -> None:
        self._results.append(self._executor.submit(work))
        self._results[-1].add_done_callback(lambda _: self._wake())

    def _take_results(self) -> list[Action]:
        done = [result for result in self._results if result.done()]
        self._results = [result for result in self._results if result not in done]
        return [_action_of(result) for result in done]

    def _take_answer(self, state: AppState) -> list[Action]:
        """Use the answer of the dialog once it is closed."""
        answer = self._dialog.answer() if self._dialog is not None else None
        if self._dialog is None or answer is None:
            return []
        asked, self._dialog = self._dialog.asked, None
        if not answer:
            return []
        if isinstance(asked, str):
            return [action_for_path(asked, answer, state)]
        there = os.path.lexists(answer)
        return [do(messages.show_prompt, replace(asked, path=answer, already_there=there, problem=""))]


def _take_path(prompt: PathPrompt, state: AppState) -> list[Action]:
    """Use a typed path; if nothing lies there, keep the prompt and state the problem."""
    path = prompt.path.strip()
    if path:
        path = _absolute(path, state)
    if not os.path.exists(path):
        problem = f"There is no file or folder {path}." if path else "Type a path."
        return [do(messages.show_prompt, replace(prompt, problem=problem))]
    return [do(messages.show_prompt, None), action_for_path(prompt.what, path, state)]


def _list(what: ChoiceOf, typed: str, path: str) -> Action:
    return do(browsing.set_listing, list_folder(what, typed, path))


def _absolute(typed: str, state: AppState) -> str:
    """Return a typed path as an absolute one; it is relative to the folder of the open photo."""
    return os.path.abspath(os.path.join(os.path.expanduser(_folder_beside(state)), os.path.expanduser(typed)))


def _find_recent(state: AppState) -> Action:
    """Return the recent files that exist; what killed exports left in the folder used last is removed."""
    if state.preferences.last_folder:
        remove_leftovers(Path(state.preferences.last_folder))
    return do(opening.set_existing_recent, tuple(filter(os.path.exists, state.recent)))


def _folder_beside(state: AppState) -> str:
    """Return the folder of the open photo, or the one used last, with a separator at its end."""
    source, last = state.source, state.preferences.opened_folder
    if last and (source is None or is_ours(source.path)):
        return os.path.join(last, "")
    path = source.path if source is not None else next(iter(state.recent), "~/photo")
    return os.path.join(os.path.dirname(path_beside(path, "photo")), "")


def _action_of(result: Future[Action]) -> Action:
    error = result.exception()
    if error is None:
        return result.result()
    text = message_of(error) if isinstance(error, Exception) else repr(error)
    return do(messages.notify, Notice(text, is_error=True))


def _open(state: AppState, path: str) -> AppState:
    return opening.open_source(state, source_beside(state.source, path))


def _read_facts(path: str) -> Action:
    from iibr_core.formats.images.metadata import camera_facts
    from iibr_core.formats.images.open_picture import read_metadata

    return do(set_facts, PhotoFacts(path, camera_facts(read_metadata(Path(path)))))


def _find_display() -> Action:
    """Return the action that shows the scene on the first display that Bridge reports. Raises InputError."""
    from iibr_core.exports.quilt import Bridge

    return do(stereo.show_on, *Bridge().first_display())


def _read_mask(path: Path) -> Action:
    """Read an aperture mask and return the action that uses it. Raises InputError."""
    from iibr_core.beyond.aperture_mask import read_mask

    mask = read_mask(path)

    def set_mask(state: AppState) -> AppState:
        shape = replace(state.optics.aperture_shape, kind="mask", mask=mask)
        return lens.set_aperture_shape(state, shape)

    return do(set_mask)
