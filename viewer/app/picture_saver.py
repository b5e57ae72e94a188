"""Saves pictures one after the other: drawn here a step at a time, between the frames of the window, written beside it.

A picture is what it was when it was asked for. It is given up where its views go while it is drawn: another scene was
opened, or the depth edited. Closing the window gives up what is being drawn and waits for what is being written.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import ceil
from pathlib import Path

import numpy as np

from iibr_core.formats.images.picture_kinds import AS_USUAL, is_float
from iibr_core.formats.outputs import AlreadyThereError, make_folder
from iibr_core.types import FloatImage, InputError
from viewer.app.clipboard import copied_path, copy_picture
from viewer.app.full_picture import DrawnFull, FullPicture, FullPictureWorker, encode_light, is_full, needs_smaller
from viewer.app.image_export import SavedShot, export_picture, shot_of
from viewer.app.save_places import picture_path
from viewer.background.file_worker import Done, FileRequest, FileWorker
from viewer.background.jobs import Failed, ProgressReport, message_of
from viewer.display.scene_view import SceneView
from viewer.gpu.refocus.picture_drawing import PictureDrawing, Pixels
from viewer.gpu.refocus.render_settings import RenderSettings
from viewer.model.actions import Action, EditsSaved, Notify, ShowPrompt
from viewer.model.layout import ScreenSize
from viewer.model.state.app_state import AppState
from viewer.model.state.notices import Notice
from viewer.model.state.prompts import SavePrompt
from viewer.model.state.saving import Saving, SavingChanged
from viewer.model.state.scene import Progress
from viewer.model.state.tasks import SaveTask

SHARE_OF_SMALLER = 0.2
"""Of the work on a picture at the photo's own size: the picture at the views' size."""
TOLD_FROM = 0.05
"""Of the work must be done before it can be said how long the rest takes."""


@dataclass(frozen=True, eq=False)
class PictureRequest:
    """A picture as it was asked for. views: what it is drawn from, see `_views_of`. full: where it is drawn from the
    photo at its own size, and from the views only what that needs of them. is_copied: the clipboard gets the file.
    """

    path: Path
    shot: SavedShot
    views: tuple[int, int]
    full: FullPicture | None = None
    is_copied: bool = False

    @property
    def needs_views(self) -> bool:
        """Whether the views take part in it."""
        return self.full is None or needs_smaller(self.full.optics)


class PictureSaver:
    """Call it only from the GL thread; the file is written in a thread of its own."""

    def __init__(self, scene_view: SceneView, wake: Callable[[], None]) -> None:
        """wake: called, in that thread, when a file is written."""
        self._scene_view = scene_view
        self._writer = FileWorker("iibr-writer", wake)
        self._requests: deque[PictureRequest] = deque()
        self._drawing: PictureDrawing | None = None
        self._full = FullPictureWorker(wake)
        self._progress: Progress | None = None
        self._is_writing = False
        self._told: Saving | None = None

    @property
    def is_drawing(self) -> bool:
        """Whether `advance` has something to draw here."""
        return bool(self._requests) and not self._is_writing and self._progress is None

    @property
    def is_copying(self) -> bool:
        """Whether a picture is on its way into the clipboard."""
        return any(request.is_copied for request in self._requests)

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
        full = _full_picture(self._scene_view, state, task.size_px)
        self._requests.append(PictureRequest(path, shot, _views_of(self._scene_view), full))
        return [ShowPrompt(None)] if isinstance(state.prompt, SavePrompt) else []

    def copy(self, state: AppState) -> list[Action]:
        """Put the present picture into the clipboard, at the size of the views."""
        if state.scene is None:
            return [Notify(Notice("There is no picture to copy yet: open a photo."))]
        shot = shot_of(state, state.scene.size, AS_USUAL)
        self._requests.append(PictureRequest(copied_path(), shot, _views_of(self._scene_view), is_copied=True))
        return []

    def cancel(self) -> None:
        """Give up the picture that is being drawn. One that is being written is finished."""
        if self._requests and not self._is_writing:
            self._next()

    def advance(self, budget_s: float) -> list[Action]:
        """Draw on for about that long, and say what is saved, what failed, and how far it is."""
        actions = self._take_written() if self._is_writing else []
        if self._progress is not None:
            actions += self._take_full(self._requests[0])
        if self.is_drawing:
            actions += self._draw(self._requests[0], budget_s)
        saving = self._describe()
        if saving != self._told:
            self._told = saving
            actions.append(SavingChanged(saving))
        return actions

    def close(self) -> None:
        """Give up what is not drawn, and wait for what is being written."""
        while self._requests and not self._is_writing:
            self._next()
        self._full.close()
        self._writer.close(cancels=False)

    def _draw(self, request: PictureRequest, budget_s: float) -> list[Action]:
        if not request.needs_views:
            return self._draw_full(request, None)
        if _views_of(self._scene_view) != request.views:
            return self._fail(f"{request.path}: not saved, for what it shows was changed meanwhile; save it again")
        try:
            if self._drawing is None or self._drawing.is_stopped:  # more of the same scene is there now
                self._drawing = self._start(request)
            self._drawing.advance(budget_s)
        except (InputError, MemoryError) as error:
            return self._fail(f"{request.path}: {message_of(error)}")
        if self._drawing.is_done:
            image = self._drawing.image
            self._stop_drawing()
            return self._write(request, image) if request.full is None else self._draw_full(request, image)
        return []

    def _start(self, request: PictureRequest) -> PictureDrawing:
        """Of the picture, or of what one at the photo's own size needs."""
        shot, full = request.shot, request.full
        if full is not None:
            return self._scene_view.start_picture(full.smaller_settings)
        is_linear, saved = is_float(request.path, shot.form), shot.settings
        return self._scene_view.start_picture(
            RenderSettings(saved.optics, saved.size_px, is_linear=is_linear, color_space=shot.color_space)
        )

    def _draw_full(self, request: PictureRequest, smaller: Pixels | None) -> list[Action]:
        assert request.full is not None
        self._progress = Progress()
        self._full.submit(
            request.full if smaller is None else request.full.with_smaller(np.asarray(smaller, np.float32))
        )
        return []

    def _take_full(self, request: PictureRequest) -> list[Action]:
        """What is heard of the picture that is drawn at the photo's own size."""
        while (result := self._full.next_result()) is not None:
            match result:
                case ProgressReport():
                    self._progress = result.progress
                case Failed():
                    return self._fail(f"{request.path}: not saved. {result.message}")
                case DrawnFull(light):
                    self._progress = None
                    return self._write_full(request, light)
        return [] if not self._full.is_lost else self._fail(f"{request.path}: drawing it stopped unexpectedly")

    def _write_full(self, request: PictureRequest, light: FloatImage) -> list[Action]:
        assert request.full is not None
        is_linear, target = is_float(request.path, request.shot.form), request.shot.color_space
        encode = partial(encode_light, light, is_linear, target, request.full.scene.color_space)
        return self._write(request, encode)

    def _write(self, request: PictureRequest, image: Pixels | Callable[[], Pixels]) -> list[Action]:
        self._is_writing = True

        def work() -> Path:
            if request.is_copied:
                make_folder(request.path.parent)
            path = export_picture(request.path, image() if callable(image) else image, request.shot)
            if request.is_copied:
                copy_picture(path)
            return path

        self._writer.submit(FileRequest(0, work))
        return []

    def _take_written(self) -> list[Action]:
        result = self._writer.next_result()
        if result is None and not self._writer.is_lost:
            return []
        path, edits = self._requests[0].path, self._requests[0].shot.settings.depth_edits
        is_copied = self._requests[0].is_copied
        if isinstance(result, Done):
            self._next()
            if is_copied:
                return [Notify(Notice("Copied the picture."))]
            return [Notify(Notice(f"Saved {path}")), EditsSaved(edits)]
        return self._fail(result.message if result is not None else f"{path}: writing it stopped unexpectedly")

    def _fail(self, message: str) -> list[Action]:
        self._next()
        return [Notify(Notice(message, is_error=True))]

    def _next(self) -> None:
        """Leave the present request for the one that waits."""
        self._stop_drawing()
        if self._progress is not None:
            self._full.cancel()
            self._progress = None
        self._is_writing = False
        self._requests.popleft()

    def _stop_drawing(self) -> None:
        if self._drawing is not None:
            self._drawing.stop()
            self._drawing = None

    def _describe(self) -> Saving | None:
        if not self._requests:
            return None
        drawn, seconds_left = float(self._is_writing), None
        if self._drawing is not None:
            drawn = self._drawing.progress * (SHARE_OF_SMALLER if self._requests[0].full is not None else 1.0)
        elif self._progress is not None:
            share = self._progress.done / max(self._progress.total, 1)
            drawn = SHARE_OF_SMALLER * self._requests[0].needs_views
            drawn += share * (1 - drawn)
            seconds_left = self._progress.seconds * (1 - share) / share if share >= TOLD_FROM else None
        drawn = drawn if self._is_writing else min(int(100 * drawn), 99) / 100
        seconds_left = None if seconds_left is None else ceil(seconds_left)
        return Saving(self._requests[0].path.name, drawn, len(self._requests) - 1, seconds_left)


def _full_picture(scene_view: SceneView, state: AppState, size: ScreenSize) -> FullPicture | None:
    """The picture of this state at a size that shows more of the photo than its views do; None where it does not."""
    scene, loaded = state.scene, scene_view.loaded
    if scene is None or scene.plan is None or loaded is None or state.free_camera is not None:
        return None
    if not is_full(scene, state.optics, size):
        return None
    return FullPicture(scene, scene.plan, loaded, state.optics, size)


def refusal(task: SaveTask, state: AppState, error: InputError) -> Action:
    """Why nothing is saved: where it was asked for, whatever was typed there stays; else in a notice."""
    if isinstance(state.prompt, SavePrompt):
        return ShowPrompt(SavePrompt(task.path, task.size_px, what=task.what, problem=str(error), form=task.form))
    return Notify(Notice(str(error), is_error=True))


def _views_of(scene_view: SceneView) -> tuple[int, int]:
    """Which views there are: of which generation, and how often edited depth was shown in their place."""
    return scene_view.generation, scene_view.previews
