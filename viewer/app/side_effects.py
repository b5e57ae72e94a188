"""What the state asks of the outside world, done: files chosen, read and written. Actions come back."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any

from iibr_core.beyond.optics import ApertureMask
from iibr_core.exports.photo_folder import list_photos
from iibr_core.scenes.scene import source_beside
from viewer.app.clipboard import Pasted, paste_picture
from viewer.app.dialogs import Dialog, SaveDialog, contents_of, has_dialogs
from viewer.app.exporter import add_export
from viewer.app.job_queue import JobQueue
from viewer.app.picture_saver import add_copy, add_save
from viewer.app.save_places import inputs_of_scene
from viewer.background.depth_models import actions_of_download, download, list_models
from viewer.background.file_worker import FileRequest, FileResult, FileWorker
from viewer.background.job_threads import Failed
from viewer.background.newest import Newest
from viewer.display.scene_view import SceneView
from viewer.model import depth_models, folder, lens, messages, opening
from viewer.model.action import Action, ask, do, forget_tasks
from viewer.model.commands import action_for_path
from viewer.model.photo_facts import set_facts
from viewer.model.state.app_state import AppState
from viewer.model.state.depth_models import (
    CancelGetTask,
    GetModelTask,
    ListModelsTask,
)
from viewer.model.state.exporting import ExportTask
from viewer.model.state.folder import ListFolderTask
from viewer.model.state.jobs import CancelJobTask
from viewer.model.state.notices import Notice
from viewer.model.state.photo_facts import PhotoFacts, ReadFactsTask
from viewer.model.state.prompts import FolderContents, ListContentsTask, PathPrompt
from viewer.model.state.saving import CopyTask, PasteTask, path_beside
from viewer.model.state.tasks import (
    ChoosePlaceTask,
    ChooseTask,
    ReadMaskTask,
    SaveTask,
    Task,
)


class SideEffects:
    """Takes tasks up in the window's thread and has them carried out beside it; a file dialog is asked each turn."""

    def __init__(self, scene_view: SceneView, wake: Callable[[], None], clipboard_text: Callable[[], str]) -> None:
        """wake: called, in another thread, when something came of a task. clipboard_text: what it holds, "" without."""
        self._clipboard_text = clipboard_text
        self._jobs = JobQueue(scene_view, wake)
        self._files = FileWorker("iibr-files", wake)
        self._downloads = Newest("iibr-models", download, wake)
        self._ids = count(1)
        self._under_way: set[int] = set()
        self._masks: list[Path] = []
        self._dialog: Dialog | SaveDialog | None = None

    @property
    def is_waiting(self) -> bool:
        """Whether a dialog is open."""
        return self._dialog is not None

    @property
    def is_drawing(self) -> bool:
        """Whether a picture is being drawn to be saved or exported."""
        return self._jobs.is_drawing

    def run(self, state: AppState) -> list[Action]:
        """Take up the state's tasks and say what came of earlier ones, and of a dialog that was closed."""
        actions: list[Action] = [do(forget_tasks)] if state.tasks else []
        actions += self._take_results(state) + self._take_downloads() + self._take_answer(state)
        for task in state.tasks:
            if isinstance(task, PasteTask) and self._jobs.is_copying:
                actions.append(do(ask, task))  # later: the copy is not in the clipboard yet
                continue
            actions += self._begin(task, state)
        return actions

    def draw(self, state: AppState, budget_s: float) -> list[Action]:
        """Continue what is being saved, copied and exported, for about that long."""
        return self._jobs.advance(state, budget_s)

    def close(self) -> None:
        """Finish the files that are being written; give up everything else."""
        if self._dialog is not None:
            self._dialog.close()
        self._jobs.close()
        self._downloads.close()
        self._files.close(cancels=False)

    def _begin(self, task: Task, state: AppState) -> list[Action]:
        match task:
            case ChooseTask(what):
                if not has_dialogs():
                    return [do(messages.show_prompt, PathPrompt(what, _folder_beside(state)))]
                self._dialog = self._dialog or Dialog(what, state.source.path if state.source else "")
            case ListContentsTask(folder, what):
                self._submit(partial(contents_of, folder, what))
            case ChoosePlaceTask(prompt):
                if not has_dialogs():
                    return [
                        do(
                            messages.show_prompt,
                            PathPrompt("place", os.path.abspath(os.path.expanduser(prompt.path)), None, prompt),
                        )
                    ]
                self._dialog = self._dialog or SaveDialog(prompt)
            case ReadMaskTask(path):
                self._masks.append(Path(os.path.expanduser(path)))
                self._submit(partial(_read_mask, self._masks[-1]))
            case ReadFactsTask(path):
                self._submit(partial(_read_facts, path))
            case ListFolderTask(path):
                self._submit(partial(_list_folder, path))
            case SaveTask():
                return add_save(task, state, self._inputs(state), self._jobs)
            case ExportTask():
                return add_export(task, state, self._inputs(state), self._jobs)
            case CancelJobTask(id_):
                self._jobs.cancel(id_)
            case ListModelsTask():
                self._submit(lambda: do(depth_models.set_known, list_models()))
            case GetModelTask(name):
                self._downloads.submit(name)
            case CancelGetTask():
                self._downloads.cancel()
                return [do(depth_models.set_downloading, None)]
            case CopyTask():
                return add_copy(state, self._jobs)
            case PasteTask():
                self._submit(partial(paste_picture, self._clipboard_text()))
        return []

    def _inputs(self, state: AppState) -> tuple[Path, ...]:
        return (*inputs_of_scene(state), *self._jobs.inputs, *self._masks)

    def _submit(self, work: Callable[[], Any]) -> None:
        id_ = next(self._ids)
        self._under_way.add(id_)
        self._files.submit(FileRequest(id_, work))

    def _take_results(self, state: AppState) -> list[Action]:
        actions: list[Action] = []
        while (result := self._files.next_result()) is not None:
            self._under_way.discard(result.id)
            actions += _actions_from(result, state)
        if self._files.is_lost and self._under_way:
            self._under_way.clear()
            actions.append(
                do(
                    messages.notify,
                    Notice("Reading or writing a file stopped unexpectedly. Try it again.", is_error=True),
                )
            )
        return actions

    def _take_downloads(self) -> list[Action]:
        actions: list[Action] = []
        while (result := self._downloads.next_result()) is not None:
            actions += actions_of_download(result)
        return actions

    def _take_answer(self, state: AppState) -> list[Action]:
        answer = self._dialog.answer() if self._dialog is not None else None
        if self._dialog is None or answer is None:
            return []
        dialog, self._dialog = self._dialog, None
        if not answer:
            return []
        if isinstance(dialog, SaveDialog):
            there = os.path.lexists(answer)
            return [do(messages.show_prompt, replace(dialog.prompt, path=answer, already_there=there, problem=""))]
        return [action_for_path(dialog.what, answer, state)]


def _folder_beside(state: AppState) -> str:
    """Where to look for what is to be opened: beside what is open, at home before anything was."""
    path = "~/photo" if state.source is None else path_beside(state.source.path, "photo")
    return os.path.join(os.path.dirname(os.path.abspath(os.path.expanduser(path))), "")


def is_scene_open(state: AppState) -> bool:
    """Whether what was asked for last is open."""
    return state.scene is not None and state.scene.source is state.source


def _actions_from(result: FileResult, state: AppState) -> list[Action]:
    if isinstance(result, Failed):
        return [do(messages.notify, Notice(result.message, is_error=True))]
    match result.value:
        case ApertureMask() as mask:
            return [do(lens.set_aperture_shape, replace(state.optics.aperture_shape, kind="mask", mask=mask))]
        case FolderContents() as contents:
            return _show_contents(contents, state)
        case PhotoFacts() as facts:
            return [do(set_facts, facts)]
        case Action() as found:
            return [found]
        case Pasted(path):
            return [do(opening.open_source, source_beside(state.source, path))]
    raise AssertionError(f"nothing comes of {result.value!r}")


def _show_contents(contents: FolderContents, state: AppState) -> list[Action]:
    """Where they are still asked for."""
    prompt = state.prompt
    if not isinstance(prompt, PathPrompt) or prompt.contents is None or prompt.contents.folder != contents.folder:
        return []
    return [do(messages.show_prompt, replace(prompt, contents=contents))]


def _read_facts(path: str) -> PhotoFacts:
    """Nothing where the file is gone by now."""
    from iibr_core.formats.images.metadata import camera_facts, read_metadata

    return PhotoFacts(path, camera_facts(read_metadata(Path(path))))


def _read_mask(path: Path) -> ApertureMask:
    """Raises InputError where it is no mask."""
    from viewer.model.aperture_mask import read_mask

    return read_mask(path)


def _list_folder(path: str) -> Action:
    return do(folder.set_photos, path, list_photos(path))
