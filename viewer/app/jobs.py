"""Saves, copies and exports beside the window, one picture and one export at a time.

Each shows the scene as it was when it was asked for. It waits while the window makes the views that it needs; if the
window leaves the scene before, the job makes them itself.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterable
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import closing
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import count
from pathlib import Path
from typing import Any, Literal

from numpy.typing import NDArray

from iibr_core.beyond.optics import Optics
from iibr_core.exports.render_settings import RenderSettings, require_size
from iibr_core.exports.source import ExportSource
from iibr_core.runtime.time_left import TimeLeft
from iibr_core.runtime.work import Cancelled, raise_if_stopped, stoppable, watched
from iibr_core.scenes.scene import Scene, SceneReady, SceneRequest, ViewReady
from iibr_core.scenes.scene_gloss import gloss_request, make_maps
from viewer.app.picture_files import inputs_of_scene
from viewer.background.newest import message_of
from viewer.background.window_work import Result, Steps, WindowWork
from viewer.display.making import make_scene
from viewer.display.scene_view import SceneView
from viewer.display.snapshot import SceneSnapshot, snapshot_of
from viewer.gpu.refocus.picture_drawing import PictureDrawing, Pixels
from viewer.model import saving
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.carried_optics import carry_optics
from viewer.model.saving import STOPPING, WAITING_FOR_VIEWS, ExportPrompt, JobKind, JobProgress, SavePrompt

Needs = Literal["shown", "photo", "views"]
"""The part of the scene that a job needs: what the window shows now, the photo and its plan, or all its views."""
DRAWING = "drawing"
WAKE_INTERVAL_S = 0.1
"""Shortest time between two reports of progress that wake the window."""


@dataclass(eq=False)
class Job:
    """A save, copy or export.

    state: of the window when it was asked for. work: writes the file, in a thread. needs, pictures: what it needs of
    the scene, and the optics of its pictures. prompt: asks for the same file again. generation: number of the views
    that it shows. request: makes them again. snapshot: the views, None before it runs.
    """

    kind: JobKind
    path: Path
    state: AppState
    work: Callable[[ExportSource], list[Action]]
    needs: Callable[[Scene, Optics], Needs] = lambda scene, optics: "views"
    pictures: Callable[[Scene, Optics], Iterable[Optics]] = lambda scene, optics: (optics,)
    prompt: ExportPrompt | SavePrompt | None = None
    id: int = 0
    generation: int = 0
    request: SceneRequest | None = None
    snapshot: SceneSnapshot | None = None
    result: Future[list[Action]] | None = None
    is_cancelled: threading.Event = field(default_factory=threading.Event)
    progress: tuple[float, float, str] = (0.0, 0.0, "")
    time_left: TimeLeft = field(default_factory=TimeLeft)

    def optics_on(self, scene: Scene) -> Optics:
        """Return the optics of the job for a scene that may differ from the one it was asked for."""
        asked = self.state.scene
        return self.state.optics if scene == asked else carry_optics(self.state.optics, asked, scene)

    def release(self) -> None:
        """Release the views."""
        if self.snapshot is not None:
            self.snapshot.release()
            self.snapshot = None

    def describe(self, is_waiting_for_views: bool) -> JobProgress:
        """Return the progress for the window; it changes at most a hundred times a stage, and with the seconds left."""
        name = "the picture" if self.kind == "copy" else self.path.name
        if self.is_cancelled.is_set():
            return JobProgress(self.id, self.kind, name, STOPPING)
        if self.result is None:
            return JobProgress(self.id, self.kind, name, WAITING_FOR_VIEWS if is_waiting_for_views else "")
        done, total, doing = self.progress
        left_s = self.time_left.update(done, total, doing)
        share = int(100 * done / total) / 100 if total else 0.0
        return JobProgress(self.id, self.kind, name, doing, share, None if left_s is None else float(round(left_s)))


class Jobs:
    """The jobs that wait and run. Call it from the thread of the window."""

    def __init__(self, scene_view: SceneView, wake: Callable[[], None]) -> None:
        """wake: called, in a thread, when a job wants something drawn, has come further, or is done."""
        self._scene_view, self._wake = scene_view, wake
        self._window_work = WindowWork(wake)
        self._executor = ThreadPoolExecutor(2, "iibr-jobs")
        self._jobs: list[Job] = []
        self._ids = count(1)
        self._shown: tuple[JobProgress, ...] = ()
        self._woken_s = 0.0

    @property
    def is_drawing(self) -> bool:
        """Whether `advance` has something to draw."""
        return self._window_work.is_waiting

    @property
    def is_copying(self) -> bool:
        """Whether a picture is on its way into the clipboard."""
        return any(job.kind == "copy" for job in self._jobs)

    @property
    def inputs(self) -> tuple[Path, ...]:
        """Files that jobs may still read."""
        return tuple(path for job in self._jobs for path in inputs_of_scene(job.state))

    def writes(self, path: Path) -> bool:
        """Return whether a job will write this file or folder."""
        return any(job.path == path for job in self._jobs)

    def add(self, job: Job, scene: Scene) -> None:
        """Add a job after those that wait. scene: the open one, of the job's state."""
        state, view = job.state, self._scene_view
        job.id = next(self._ids)
        job.generation = state.generation if scene.source is state.source else view.generation
        loaded, plan = view.loaded, scene.plan
        if view.generation != job.generation or loaded is None or loaded.depth_settings != state.depth:
            loaded = plan = None  # another photo or other depth than asked for
        source = scene.source
        if scene.depth_model is not None:
            source = replace(source, depth=replace(source.depth, model=scene.depth_model))
        job.request = SceneRequest(
            0,
            source,
            state.depth_strength,
            loaded,
            state.depth,
            takes_drafts=False,
            plan=plan,
            asks_model=scene.depth_model is not None,
        )
        if job.needs(scene, state.optics) == "shown":
            job.snapshot = view.snapshot()
        self._jobs.append(job)
        self._begin(state)

    def cancel(self, id_: int) -> None:
        """Cancel the job of this id, if there is one."""
        for job in self._jobs:
            if job.id == id_:
                job.is_cancelled.set()

    def advance(self, state: AppState, budget_s: float) -> list[Action]:
        """Begin jobs, draw for about `budget_s`, and return the results and the progress."""
        actions = [action for job in list(self._jobs) for action in self._results_of(job)]
        self._begin(state)
        self._window_work.advance(budget_s)
        shown = tuple(job.describe(not self._is_ready(job, state)) for job in self._jobs)
        if shown != self._shown:
            self._shown = shown
            actions.append(do(saving.set_jobs, shown))
        return actions

    def close(self) -> None:
        """Cancel the jobs and wait for their threads; a file that is being written is finished."""
        for job in self._jobs:
            job.is_cancelled.set()
        self._executor.shutdown()
        self._window_work.forget_stopped()
        for job in self._jobs:
            job.release()

    def _begin(self, state: AppState) -> None:
        """Begin the first picture and the first export whose scene is ready, unless one of the same kind runs."""
        for is_export in (False, True):
            jobs = [job for job in self._jobs if (job.kind == "export") == is_export]
            ready = [job for job in jobs if self._is_ready(job, state)]
            if ready and not any(job.result for job in jobs):
                self._run_in_thread(ready[0], state)

    def _is_ready(self, job: Job, state: AppState) -> bool:
        """Return whether a job need not wait: the window has what it needs, or does not make it."""
        is_made = state.generation == job.generation and bool(state.progress.total or state.progress.doing)
        return job.snapshot is not None or self._is_shown(job, state) or not is_made or state.stopped == job.generation

    def _is_shown(self, job: Job, state: AppState) -> bool:
        """Return whether the window shows all that a job needs, or as much as the user wants of a picture."""
        view, scene = self._scene_view, state.scene
        if view.generation != job.generation or scene is None:
            return False
        has_photo = job.needs(scene, job.optics_on(scene)) == "photo" and not scene.is_sketch
        is_stopped = state.stopped == state.generation == job.generation and job.kind != "export"
        return view.is_whole or has_photo or is_stopped

    def _run_in_thread(self, job: Job, state: AppState) -> None:
        if job.snapshot is None and self._is_shown(job, state):
            job.snapshot = self._scene_view.snapshot()
        job.result = self._executor.submit(self._carry_out, job)
        job.result.add_done_callback(lambda _: self._wake())

    def _carry_out(self, job: Job) -> list[Action]:
        try:
            with stoppable(job.is_cancelled.is_set), watched(partial(self._report, job)):
                raise_if_stopped()
                return job.work(self._source_of(job))
        except Cancelled:
            return []

    def _results_of(self, job: Job) -> list[Action]:
        """Remove a job that is done or was cancelled before it began, and return its actions."""
        if not (job.result.done() if job.result is not None else job.is_cancelled.is_set()):
            return []
        self._jobs.remove(job)
        job.release()
        if job.result is None:
            return []
        error = job.result.exception()
        if error is not None:
            text = message_of(error) if isinstance(error, Exception) else f"{job.path}: not written ({error!r})"
            return [do(saving.fail_job, job.path, text, job.prompt)]
        return job.result.result()

    # In the threads of the jobs; what touches OpenGL is handed to the window's

    def _source_of(self, job: Job) -> ExportSource:
        """Return the source of an export. Raises InputError if its scene cannot be opened, Cancelled."""
        snapshot = job.snapshot or self._make_scene(job)

        def report(share: float) -> None:
            if job.kind != "export":  # exports count their pictures themselves
                job.progress = (share, 1.0, DRAWING)

        def draw(settings: RenderSettings) -> NDArray[Any]:
            require_size(settings.size_px)
            request = gloss_request(settings.optics.gloss, snapshot.scene, snapshot.centre, snapshot.gloss)
            if request is not None and not snapshot.is_free_view:
                self._run(job, _in_one_step(partial(snapshot.take_gloss, make_maps(request))))
            drawing = self._scene_view.renderer.start_picture
            return self._run(job, drawn(partial(drawing, settings, snapshot.field), report))

        return ExportSource(snapshot.scene, snapshot.loaded, job.optics_on(snapshot.scene), draw, snapshot.centre)

    def _report(self, job: Job, done: float, total: float, doing: str) -> None:
        """Note the progress of a job, and wake the window now and then."""
        job.progress = (done, total, doing)
        now_s = time.perf_counter()
        if now_s - self._woken_s >= WAKE_INTERVAL_S:
            self._woken_s = now_s
            self._wake()

    def _make_scene(self, job: Job) -> SceneSnapshot:
        """Open the scene of a job and make the views that its pictures show."""

        def pictures_of(scene: Scene) -> Iterable[Optics]:
            optics = job.optics_on(scene)
            return () if job.needs(scene, optics) == "photo" else job.pictures(scene, optics)

        def upload(made: SceneReady | ViewReady) -> None:
            if job.snapshot is None:
                assert isinstance(made, SceneReady)
                job.snapshot = snapshot_of(self._scene_view.renderer.gl, made)
            elif isinstance(made, ViewReady):
                job.snapshot.add(made)

        assert job.request is not None
        make_scene(job.request, lambda made: self._run(job, _in_one_step(partial(upload, made))), pictures_of)
        assert job.snapshot is not None
        return job.snapshot

    def _run(self, job: Job, steps: Steps[Result]) -> Result:
        return self._window_work.run(steps, is_urgent=job.kind != "export")


def _in_one_step(work: Callable[[], Result]) -> Steps[Result]:
    yield from ()
    return work()


def drawn(start: Callable[[], PictureDrawing], report: Callable[[float], None] = lambda share: None) -> Steps[Pixels]:
    """Draw a picture in the window's thread, a step at a time, and return its pixels. report: takes the share drawn."""
    drawing = start()
    with closing(drawing.steps()) as steps:
        for share in steps:
            report(share)
            yield
    return drawing.image
