"""What the state asks of the outside world, done: files chosen, masks read, pictures written. Actions come back."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from iibr_core.types import InputError
from viewer.app.dialogs import Dialog, has_dialogs
from viewer.app.image_export import MAX_PIXELS, AlreadyThereError, save_map, save_picture
from viewer.display.scene_view import SceneView
from viewer.model.actions import Action, AskForPath, DismissNotice, Notify, SetApertureShape, ShowPrompt, TaskTaken
from viewer.model.opening import action_for_path
from viewer.model.state.app_state import (
    AppState,
    ChooseTask,
    Notice,
    ReadMaskTask,
    ReadTruthTask,
    SavePrompt,
    SaveTask,
    Task,
)
from viewer.model.state.inspection import GroundTruth, TruthRead

LARGE_PIXELS = 4_000_000
"""Of a picture: saving it then takes seconds."""

TURNS_ANNOUNCED = 4
"""ImGui lays out in two frames; so many turns later a notice is on the screen for certain."""


class SideEffects:
    """Carries out tasks in the window's thread; the one that takes long, a file dialog, is asked again each turn.

    A large picture is announced first: while it is drawn and written the window stands still.
    """

    def __init__(self, scene_view: SceneView) -> None:
        self._scene_view = scene_view
        self._dialog: Dialog | None = None
        self._announced: tuple[SaveTask, int] | None = None

    @property
    def is_waiting(self) -> bool:
        """Whether a dialog is open, or a notice must be seen first."""
        return self._dialog is not None or self._announced is not None

    def run(self, state: AppState) -> list[Action]:
        """Take up the state's tasks and say what came of them, and of a dialog that was closed."""
        actions = self._answered(state)
        for task in state.tasks:
            if isinstance(task, ReadTruthTask) and not is_scene_open(state):
                continue  # what it must fit is not known yet
            if isinstance(task, SaveTask) and self._must_announce(task):
                actions.append(Notify(saving_notice(task)))
                continue
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
                return _load_mask(path, state)
            case ReadTruthTask(path):
                return _read_truth(path)
            case SaveTask():
                self._announced = None
                return [DismissNotice(saving_notice(task)), *self._saved(task, state)]

    def _must_announce(self, task: SaveTask) -> bool:
        """Whether the notice about it has not been on the screen for some turns."""
        pixels = task.size_px[0] * task.size_px[1]
        if task.what == "map" or not LARGE_PIXELS <= pixels <= MAX_PIXELS:
            return False  # what is too large is refused at once
        turns = self._announced[1] + 1 if self._announced is not None and self._announced[0] == task else 0
        self._announced = task, turns
        return turns < TURNS_ANNOUNCED

    def _saved(self, task: SaveTask, state: AppState) -> list[Action]:
        if state.scene is None:
            return []
        try:
            if task.what == "map":
                if self._scene_view.generation != state.generation:
                    return [Notify(Notice("The map is still being made; save it again in a moment."))]
                return [Notify(Notice(save_map(self._scene_view, task)))]
            path = save_picture(self._scene_view, state, task)
        except AlreadyThereError:
            return [ShowPrompt(SavePrompt(task.path, task.size_px, already_there=True, what=task.what))]
        except InputError as error:
            return [Notify(Notice(str(error), is_error=True))]
        return [Notify(Notice(f"Saved {path}"))]

    def _answered(self, state: AppState) -> list[Action]:
        answer = self._dialog.answer() if self._dialog is not None else None
        if self._dialog is None or answer is None:
            return []
        what, self._dialog = self._dialog.what, None
        if not answer:
            return []
        return [action_for_path(what, answer, state)]


def saving_notice(task: SaveTask) -> Notice:
    """Shown while a large picture is saved."""
    width, height = task.size_px
    return Notice(f"Drawing and writing {width} × {height} px; the window stands still for a while.")


def is_scene_open(state: AppState) -> bool:
    """Whether what was asked for last is open."""
    return state.scene is not None and state.scene.source is state.source


def _read_truth(path: str) -> list[Action]:
    from iibr_core.formats.light_fields.hci import read_light_field

    try:
        header, _ = read_light_field(Path(path).expanduser())
    except InputError as error:
        return [Notify(Notice(str(error), is_error=True))]
    return [TruthRead(GroundTruth(path, header.name, header.grid, header.width, header.height))]


def _load_mask(path: str, state: AppState) -> list[Action]:
    from viewer.model.lens.aperture_mask import read_mask

    try:
        mask = read_mask(Path(path).expanduser())
    except InputError as error:
        return [Notify(Notice(str(error), is_error=True))]
    return [SetApertureShape(replace(state.optics.aperture_shape, kind="mask", mask=mask))]
