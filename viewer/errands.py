"""What the state asks of the outside world, done: files chosen, masks read, pictures written. Actions come back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from iibr_core.types import InputError
from viewer.actions import Action, AskForPath, DoTask, Notify, OpenPath, SetApertureShape, ShowPrompt, TaskTaken
from viewer.dialogs import Dialog, has_dialogs
from viewer.inspection import GroundTruth, TruthRead
from viewer.saving import AlreadyThereError, save_picture
from viewer.stage import Stage
from viewer.state import AppState, ChooseTask, Notice, ReadMaskTask, ReadTruthTask, SavePrompt, SaveTask, Source, Task


class Errands:
    """Carries out tasks in the window's thread; the one that takes long, a file dialog, is asked again each turn."""

    def __init__(self, stage: Stage) -> None:
        self._stage = stage
        self._dialog: Dialog | None = None

    @property
    def is_waiting(self) -> bool:
        """Whether a dialog is open."""
        return self._dialog is not None

    def run(self, state: AppState) -> list[Action]:
        """Take up the state's tasks and say what came of them, and of a dialog that was closed."""
        actions = self._answered()
        for task in state.tasks:
            if isinstance(task, ReadTruthTask) and not is_scene_open(state):
                continue  # what it must fit is not known yet
            actions += [TaskTaken(task), *self._done(task, state)]
        return actions

    def _done(self, task: Task, state: AppState) -> list[Action]:
        match task:
            case ChooseTask(what):
                if not has_dialogs():
                    return [AskForPath(what)]
                self._dialog = self._dialog or Dialog(what)
                return []
            case ReadMaskTask(path):
                return _mask_read(path, state)
            case ReadTruthTask(path):
                return _truth_read(path)
            case SaveTask():
                return self._saved(task, state)

    def _saved(self, task: SaveTask, state: AppState) -> list[Action]:
        if state.scene is None:
            return []
        try:
            path = save_picture(self._stage, state, task)
        except AlreadyThereError:
            return [ShowPrompt(SavePrompt(task.path, task.size_px, already_there=True))]
        except InputError as error:
            return [Notify(Notice(str(error), is_error=True))]
        return [Notify(Notice(f"Saved {path}"))]

    def _answered(self) -> list[Action]:
        answer = self._dialog.answer() if self._dialog is not None else None
        if self._dialog is None or answer is None:
            return []
        what, self._dialog = self._dialog.what, None
        if not answer:
            return []
        tasks: dict[str, Task] = {"mask": ReadMaskTask(answer), "truth": ReadTruthTask(answer)}
        return [DoTask(tasks[what]) if what in tasks else OpenPath(Source(answer))]


def is_scene_open(state: AppState) -> bool:
    """Whether what was asked for last is open."""
    return state.scene is not None and state.scene.source is state.source


def _truth_read(path: str) -> list[Action]:
    from iibr_core.formats.hci import read_light_field

    try:
        header, _ = read_light_field(Path(path).expanduser())
    except InputError as error:
        return [Notify(Notice(str(error), is_error=True))]
    return [TruthRead(GroundTruth(path, header.name, header.grid, header.width, header.height))]


def _mask_read(path: str, state: AppState) -> list[Action]:
    from viewer.aperture_mask import read_mask

    try:
        mask = read_mask(Path(path).expanduser())
    except InputError as error:
        return [Notify(Notice(str(error), is_error=True))]
    return [SetApertureShape(replace(state.optics.aperture_shape, kind="mask", mask=mask))]
