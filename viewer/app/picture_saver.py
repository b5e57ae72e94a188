"""Saves pictures one after the other: drawn here a step at a time, between the frames of the window, written beside it.

A picture is what it was when it was asked for. It is given up where its views go while it is drawn: another scene was
opened, or the depth edited. Closing the window gives up what is being drawn and waits for what is being written.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from iibr_core.formats.images.picture_kinds import is_float
from iibr_core.formats.outputs import AlreadyThereError
from iibr_core.types import InputError
from viewer.app.image_export import SavedShot, export_picture, shot_of
from viewer.app.save_places import picture_path
from viewer.background.file_worker import Done, FileRequest, FileWorker
from viewer.background.jobs import message_of
from viewer.display.scene_view import SceneView
from viewer.gpu.refocus.picture_drawing import PictureDrawing
from viewer.model.actions import Action, EditsSaved, Notify, ShowPrompt
from viewer.model.state.app_state import AppState, Notice, SavePrompt, SaveTask
from viewer.model.state.saving import Saving, SavingChanged


@dataclass(frozen=True, eq=False)
class PictureRequest:
    """A picture as it was asked for. views: what it is drawn from, see `_views_of`."""

    path: Path
    shot: SavedShot
    views: tuple[int, int]


class PictureSaver:
    """Call it only from the GL thread; the file is written in a thread of its own."""

    def __init__(self, scene_view: SceneView, wake: Callable[[], None]) -> None:
        """wake: called, in that thread, when a file is written."""
        self._scene_view = scene_view
        self._writer = FileWorker("iibr-writer", wake)
        self._requests: deque[PictureRequest] = deque()
        self._drawing: PictureDrawing | None = None
        self._is_writing = False
        self._told: Saving | None = None

    @property
    def is_drawing(self) -> bool:
        """Whether `advance` has something to draw."""
        return bool(self._requests) and not self._is_writing

    def add(self, task: SaveTask, state: AppState, inputs: Sequence[Path]) -> list[Action]:
        """Save the present picture after those asked for before; says so where that cannot be. inputs: what is read."""
        if state.scene is None:
            return []
        try:
            path = picture_path(task, inputs)
            if not task.may_replace and any(request.path == path for request in self._requests):
                raise AlreadyThereError(f"{path}: is about to be written")
        except AlreadyThereError:
            return [ShowPrompt(SavePrompt(task.path, task.size_px, already_there=True, form=task.form))]
        except InputError as error:
            return [refusal(task, state, error)]
        shot = shot_of(state, task.size_px, task.form)
        self._requests.append(PictureRequest(path, shot, _views_of(self._scene_view)))
        return [ShowPrompt(None)] if isinstance(state.prompt, SavePrompt) else []

    def cancel(self) -> None:
        """Give up the picture that is being drawn. One that is being written is finished."""
        if self.is_drawing:
            self._next()

    def advance(self, budget_s: float) -> list[Action]:
        """Draw on for about that long, and say what is saved, what failed, and how far it is."""
        actions = self._take_written() if self._is_writing else []
        if self.is_drawing:
            actions += self._draw(self._requests[0], budget_s)
        saving = self._describe()
        if saving != self._told:
            self._told = saving
            actions.append(SavingChanged(saving))
        return actions

    def close(self) -> None:
        """Give up what is not drawn, and wait for what is being written."""
        while self.is_drawing:
            self._next()
        self._writer.close(cancels=False)

    def _draw(self, request: PictureRequest, budget_s: float) -> list[Action]:
        if _views_of(self._scene_view) != request.views:
            return self._fail(f"{request.path}: not saved, for what it shows was changed meanwhile; save it again")
        settings = request.shot.settings
        try:
            if self._drawing is None or self._drawing.is_stopped:  # more of the same scene is there now
                is_linear = is_float(request.path, request.shot.form)
                self._drawing = self._scene_view.start_picture(
                    settings.optics, settings.size_px, is_linear, color_space=request.shot.color_space
                )
            self._drawing.advance(budget_s)
        except (InputError, MemoryError) as error:
            return self._fail(f"{request.path}: {message_of(error)}")
        if self._drawing.is_done:
            self._write(request, self._drawing)
        return []

    def _write(self, request: PictureRequest, drawing: PictureDrawing) -> None:
        self._is_writing = True
        work = partial(export_picture, request.path, drawing.image, request.shot)
        self._stop_drawing()
        self._writer.submit(FileRequest(0, work))

    def _take_written(self) -> list[Action]:
        result = self._writer.next_result()
        if result is None and not self._writer.is_lost:
            return []
        path, edits = self._requests[0].path, self._requests[0].shot.settings.depth_edits
        if isinstance(result, Done):
            self._next()
            return [Notify(Notice(f"Saved {path}")), EditsSaved(edits)]
        return self._fail(result.message if result is not None else f"{path}: writing it stopped unexpectedly")

    def _fail(self, message: str) -> list[Action]:
        self._next()
        return [Notify(Notice(message, is_error=True))]

    def _next(self) -> None:
        """Leave the present request for the one that waits."""
        self._stop_drawing()
        self._is_writing = False
        self._requests.popleft()

    def _stop_drawing(self) -> None:
        if self._drawing is not None:
            self._drawing.stop()
            self._drawing = None

    def _describe(self) -> Saving | None:
        if not self._requests:
            return None
        drawn = float(self._is_writing)
        if self._drawing is not None:
            drawn = min(int(100 * self._drawing.progress), 99) / 100
        return Saving(self._requests[0].path.name, drawn, len(self._requests) - 1)


def refusal(task: SaveTask, state: AppState, error: InputError) -> Action:
    """Why nothing is saved: where it was asked for, whatever was typed there stays; else in a notice."""
    if isinstance(state.prompt, SavePrompt):
        return ShowPrompt(SavePrompt(task.path, task.size_px, what=task.what, problem=str(error), form=task.form))
    return Notify(Notice(str(error), is_error=True))


def _views_of(scene_view: SceneView) -> tuple[int, int]:
    """Which views there are: of which generation, and how often edited depth was shown in their place."""
    return scene_view.generation, scene_view.previews
