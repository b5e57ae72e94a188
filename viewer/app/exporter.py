"""Exports one after the other, in a thread beside the window; what that wants drawn is drawn here, a step at a time,
between the frames of the window.

An export is of what was shown when it was asked for. It is given up where its views go before it is done: another scene
was opened, or the depth edited. Closing the window gives up all of them; nothing is left half-written.
"""

from __future__ import annotations

import os
import queue
import threading
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from iibr_core.formats.outputs import AlreadyThereError
from iibr_core.runtime.extras import require_extra
from iibr_core.runtime.tiling import Cancelled, raise_if_stopped
from iibr_core.types import InputError
from viewer.app.exports.registry import export_path, require_export_place, writer_of
from viewer.app.exports.source import ExportSource
from viewer.app.save_places import require_size
from viewer.background.file_worker import Done, FileRequest, FileWorker
from viewer.display.scene_view import SceneView
from viewer.gpu.refocus.picture_drawing import PictureDrawing
from viewer.gpu.refocus.render_settings import RenderSettings
from viewer.model.actions import Action, Notify, ShowPrompt
from viewer.model.export_kinds import export_kind
from viewer.model.state.app_state import AppState
from viewer.model.state.exporting import Exporting, ExportingChanged, ExportPrompt, ExportTask
from viewer.model.state.notices import Notice

LOOK_S = 0.05
"""How often a thread that waits for its picture looks whether it is still wanted."""


@dataclass(eq=False)
class _Wanted:
    """A picture that the thread waits for. is_drawn: set once image or error is there."""

    settings: RenderSettings
    is_drawn: threading.Event = field(default_factory=threading.Event)
    image: NDArray[Any] | None = None
    error: Exception | None = None


@dataclass(eq=False)
class _Export:
    """views: what it is drawn from, see `_views_of`. is_given_up: by the user, or because its views went."""

    path: Path
    views: tuple[int, int]
    is_given_up: threading.Event = field(default_factory=threading.Event)
    progress: tuple[float, str] = (0.0, "")
    reason: str = ""


class Exporter:
    """Call it only from the GL thread."""

    def __init__(self, scene_view: SceneView, wake: Callable[[], None]) -> None:
        """wake: called, in the thread, when it wants a picture, has come further, or is done."""
        self._scene_view, self._wake = scene_view, wake
        self._thread = FileWorker("iibr-exporter", wake)
        self._exports: deque[_Export] = deque()
        self._asked: queue.SimpleQueue[_Wanted] = queue.SimpleQueue()
        self._wanted: _Wanted | None = None
        self._drawing: PictureDrawing | None = None
        self._told: Exporting | None = None

    @property
    def is_drawing(self) -> bool:
        """Whether `advance` has something to draw."""
        return self._wanted is not None or not self._asked.empty()

    def add(self, task: ExportTask, state: AppState, inputs: Sequence[Path]) -> list[Action]:
        """Export the present scene after what was asked for before, or say why not. inputs: what is read."""
        scene, loaded = state.scene, self._scene_view.loaded
        asked = ExportPrompt(task.kind, task.path, task.options)
        if scene is None:
            return []
        if not state.progress.is_complete or self._scene_view.generation != state.generation:
            return [Notify(Notice("The views are still being made; export them when all are there."))]
        try:
            kind = export_kind(task.kind)
            path = export_path(kind, Path(os.path.expanduser(task.path.strip())), scene, task.options)
            require_export_place(kind, path, inputs, task.may_replace)
            if kind.needs:
                require_extra("export", *kind.needs)
            if any(export.path == path for export in self._exports):
                raise InputError(f"{path}: is being written; choose another name")
        except AlreadyThereError:
            return [ShowPrompt(replace(asked, already_there=True))]
        except InputError as error:
            return [ShowPrompt(replace(asked, problem=str(error)))]
        export = _Export(path, _views_of(self._scene_view))
        source = ExportSource(
            scene,
            loaded,
            state.optics,
            partial(self._draw, export),
            partial(self._report_progress, export),
            export.is_given_up.is_set,
            self._scene_view.centre,
        )
        self._exports.append(export)
        self._thread.submit(FileRequest(0, partial(_carry_out, writer_of(kind), export, source, task.options)))
        return [ShowPrompt(None)] if isinstance(state.prompt, ExportPrompt) else []

    def cancel(self) -> None:
        """Give up what is being exported."""
        if self._exports:
            self._exports[0].is_given_up.set()

    def advance(self, budget_s: float) -> list[Action]:
        """Draw on for about that long, and say what is exported, what failed, and how far it is."""
        actions = self._take_results()
        for export in self._exports:
            if export.views != _views_of(self._scene_view) and not export.is_given_up.is_set():
                export.reason = f"{export.path}: not exported, for what it shows was changed meanwhile; export it again"
                export.is_given_up.set()
        self._draw_on(budget_s)
        exporting = self._describe()
        if exporting != self._told:
            self._told = exporting
            actions.append(ExportingChanged(exporting))
        return actions

    def close(self) -> None:
        """Give everything up, and wait for the thread to tidy up."""
        for export in self._exports:
            export.is_given_up.set()
        self._stop_drawing()
        self._thread.close(cancels=False)

    def _draw(self, export: _Export, settings: RenderSettings) -> NDArray[Any]:
        """In the thread: have it drawn, and wait."""
        require_size(settings.size_px)
        wanted = _Wanted(settings)
        self._asked.put(wanted)
        self._wake()
        while not wanted.is_drawn.wait(LOOK_S):
            raise_if_stopped(export.is_given_up.is_set)
        if wanted.error is not None:
            raise wanted.error
        assert wanted.image is not None
        return wanted.image

    def _report_progress(self, export: _Export, done: float, total: float, doing: str) -> None:
        """In the thread."""
        export.progress = (done / total if total else 0.0, doing)
        self._wake()

    def _draw_on(self, budget_s: float) -> None:
        if self._wanted is None and not self._asked.empty():
            self._wanted = self._asked.get()
        wanted = self._wanted
        if wanted is None:
            return
        if not self._exports or self._exports[0].is_given_up.is_set():
            self._stop_drawing()  # nobody waits for it any more
            return
        try:
            if self._drawing is None or self._drawing.is_stopped:  # a picture was saved meanwhile
                self._drawing = self._scene_view.start_picture(wanted.settings)
            self._drawing.advance(budget_s)
        except (InputError, MemoryError) as error:
            wanted.error = error
        else:
            if not self._drawing.is_done:
                return
            wanted.image = self._drawing.image
        self._stop_drawing()
        wanted.is_drawn.set()

    def _stop_drawing(self) -> None:
        if self._drawing is not None:
            self._drawing.stop()
        self._drawing = self._wanted = None

    def _take_results(self) -> list[Action]:
        actions: list[Action] = []
        while (result := self._thread.next_result()) is not None:
            export = self._exports.popleft()
            if isinstance(result, Done):
                said = result.value or export.reason
                actions += [Notify(Notice(said, is_error=not result.value))] if said else []
            else:
                actions.append(Notify(Notice(result.message, is_error=True)))
        if self._thread.is_lost and self._exports:
            path = self._exports.popleft().path
            actions.append(Notify(Notice(f"{path}: exporting it stopped unexpectedly", is_error=True)))
        return actions

    def _describe(self) -> Exporting | None:
        if not self._exports:
            return None
        done, doing = self._exports[0].progress
        return Exporting(self._exports[0].path.name, int(100 * done) / 100, doing, len(self._exports) - 1)


def _carry_out(write: Callable[..., str | None], export: _Export, source: ExportSource, options: Any) -> str:
    """In the thread: what is to be said of it; nothing where it was given up."""
    try:
        raise_if_stopped(source.should_stop)
        said = write(export.path, source, options)
    except Cancelled:
        return ""
    return f"Exported {export.path}. {said}" if said else f"Exported {export.path}"


def _views_of(scene_view: SceneView) -> tuple[int, int]:
    """Which views there are: of which generation, and how often edited depth was shown in their place."""
    return scene_view.generation, scene_view.previews
