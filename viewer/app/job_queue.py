"""Saves, copies, exports and fills beside the window, in the order in which they were asked for; of each lane the first
is under way.

Each works on a snapshot: the scene, its views and the lens as they were when it was asked for. Where the views are
still being made, it waits for them; where the window leaves the scene before, the job makes them itself, in its turn.
"""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from itertools import count
from pathlib import Path

from iibr_core.runtime.work import Cancelled, raise_if_stopped, stoppable, watched
from iibr_core.scenes.scene import SceneRequest
from viewer.app.job import Job, Lane
from viewer.app.job_scene import JobScenes
from viewer.app.save_places import inputs_of_scene
from viewer.background.file_worker import Done, FileRequest, FileWorker
from viewer.background.window_work import WindowWork
from viewer.display.scene_view import SceneView
from viewer.model import messages, saving
from viewer.model.action import Action, do
from viewer.model.state.app_state import AppState
from viewer.model.state.jobs import JobProgress
from viewer.model.state.notices import Notice


class JobQueue:
    """Call it only from the thread of the window."""

    def __init__(self, scene_view: SceneView, wake: Callable[[], None]) -> None:
        """wake: called, in another thread, when a job wants something drawn, has come further, or is done."""
        self._scene_view = scene_view
        self._window_work = WindowWork(wake)
        self._scenes = JobScenes(scene_view, self._window_work, wake)
        self._threads: dict[Lane, FileWorker] = {
            "pictures": FileWorker("iibr-pictures", wake),
            "exports": FileWorker("iibr-exports", wake),
        }
        self._jobs: list[Job] = []
        self._ids = count(1)
        self._told: tuple[JobProgress, ...] = ()

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
        """What the jobs may still read: nothing may be written there."""
        return tuple(path for job in self._jobs for path in inputs_of_scene(job.state))

    def writes(self, path: Path) -> bool:
        """Whether a job is to write this file or folder."""
        return any(job.path == path for job in self._jobs)

    def add(self, job: Job) -> None:
        """After those that were asked for before. Its state has a scene open."""
        state, view = job.state, self._scene_view
        assert state.scene is not None
        assert state.source is not None
        is_newest = state.scene.source is state.source
        job.id, job.generation = next(self._ids), state.generation if is_newest else view.generation
        source = state.source if is_newest else state.scene.source
        loaded, plan = view.loaded, state.scene.plan
        if view.generation != job.generation or loaded is None or loaded.depth_settings != state.depth:
            loaded = plan = None  # what is loaded is not what was asked for
        asks = state.scene.depth_model is not None
        job.request = SceneRequest(
            0, source, state.depth_strength, loaded, state.depth, takes_drafts=False, plan=plan, asks_model=asks
        )
        self._jobs.append(job)
        self._prepare(job, state)

    def cancel(self, id_: int) -> None:
        """Give this one up; nothing happens where it is done."""
        for job in self._jobs:
            if job.id == id_:
                job.is_given_up.set()

    def advance(self, state: AppState, budget_s: float) -> list[Action]:
        """Begin what can begin, draw on for about that long, and say what is done, what failed, and how far it is."""
        actions = [action for lane in self._threads for action in self._take_result(lane, state)]
        for job in [job for job in self._jobs if not job.is_running]:
            if job.is_given_up.is_set():
                self._end(job)
            else:
                self._prepare(job, state)
        self._release_left()
        for lane in self._threads:
            self._begin_next(lane)
        self._window_work.advance(budget_s)
        shown = tuple(job.describe() for job in self._jobs)
        if shown != self._told:
            self._told = shown
            actions.append(do(saving.set_jobs, shown))
        return actions

    def close(self) -> None:
        """Give everything up, and wait for the threads to tidy up; a file that is being written is finished."""
        for job in self._jobs:
            job.is_given_up.set()
        for thread in self._threads.values():
            thread.close(cancels=False)
        self._window_work.forget_stopped()
        for job in list(self._jobs):
            self._end(job)

    def _prepare(self, job: Job, state: AppState) -> None:
        """Take the snapshot once what the job needs is there; see that it is never waited for in vain."""
        if job.snapshot is not None or job.is_left:
            return
        view, scene = self._scene_view, job.state.scene
        is_shown = view.generation == job.generation
        is_stopped = state.stopped == state.generation == job.generation
        assert scene is not None
        if is_shown and state.scene is not None:
            needs = job.needs(state.scene, job.optics_on(state.scene))
            is_there = needs == "shown" or view.is_whole or (needs == "scene" and not state.scene.is_sketch)
            if is_there or (is_stopped and job.takes_part):
                job.snapshot = view.snapshot()
                return
        is_on_its_way = state.generation == job.generation and bool(state.progress.total or state.progress.doing)
        job.is_left = is_stopped or not is_on_its_way

    def _release_left(self) -> None:
        """Views that are no longer shown are kept for what is being drawn only: the others are made once more, for
        memory would not hold many. A free camera's is one view, and cannot be made once more.
        """
        running = [job.snapshot for job in self._jobs if job.is_running and job.snapshot is not None]
        for job in self._jobs:
            snapshot = job.snapshot
            if job.is_running or snapshot is None or snapshot.is_free_view or self._scene_view.is_shown(snapshot):
                continue
            if not any(other.field.colors is snapshot.field.colors for other in running):
                snapshot.release()
                job.snapshot, job.is_left = None, True

    def _begin_next(self, lane: Lane) -> None:
        """The first that can begin, where none is running."""
        jobs = [job for job in self._jobs if job.lane == lane]
        ready = [job for job in jobs if job.snapshot is not None or job.is_left]
        if ready and not any(job.is_running for job in jobs):
            ready[0].is_running = True
            self._threads[lane].submit(FileRequest(ready[0].id, partial(_carry_out, ready[0], self._scenes)))

    def _take_result(self, lane: Lane, state: AppState) -> list[Action]:
        thread = self._threads[lane]
        running = next((job for job in self._jobs if job.is_running and job.lane == lane), None)
        if running is None:
            return []
        result = thread.next_result()
        if result is None and not thread.is_lost:
            return []
        self._end(running)
        if isinstance(result, Done):
            done: list[Action] = result.value
            return done
        lost = f"{running.path}: writing it stopped unexpectedly, and there is no such file. Try it again."
        return [do(messages.notify, Notice(lost if result is None else result.message, is_error=True, stays=True))]

    def _end(self, job: Job) -> None:
        self._jobs.remove(job)
        job.is_given_up.set()  # a thread that was lost left steps behind
        if job.snapshot is not None:
            job.snapshot.release()
            job.snapshot = None


def _carry_out(job: Job, scenes: JobScenes) -> list[Action]:
    """In the thread: what comes of it; nothing where it was given up."""
    try:
        with stoppable(job.should_stop), watched(partial(scenes.report, job)):
            raise_if_stopped()
            return job.work(scenes.source_of(job))
    except Cancelled:
        return []
