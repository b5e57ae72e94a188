"""What a job shows, made ready in its thread: the snapshot of the window's scene, or the same scene made once more
where the window left it before all was there.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from contextlib import closing
from typing import Any

from numpy.typing import NDArray

from iibr_core.beyond.optics import CENTRE
from iibr_core.exports.render_settings import RenderSettings, require_size
from iibr_core.exports.source import ExportSource
from iibr_core.runtime.work import report_progress
from iibr_core.scenes.scene import MAKING, SceneReady, ViewReady
from iibr_core.scenes.scene_gloss import gloss_request, make_maps
from iibr_core.types import ViewOffset, ViewUpdate
from viewer.app.job import Job
from viewer.background.window_work import Result, Steps, WindowWork
from viewer.display.scene_view import SceneView
from viewer.display.snapshot import SceneSnapshot, snapshot_of
from viewer.gpu.refocus.views_seen import views_seen_by

DRAWING = "drawing"
WAKE_EVERY_S = 0.1
"""Progress wakes the window no more often: each time it draws a frame."""


class JobScenes:
    """Everything is called from the threads of the jobs; what touches OpenGL is handed to the window's."""

    def __init__(self, scene_view: SceneView, window_work: WindowWork, wake: Callable[[], None]) -> None:
        """wake: called, in the thread, when a job has come further."""
        self._scene_view, self._window_work, self._wake = scene_view, window_work, wake
        self._woken_s = 0.0

    def source_of(self, job: Job) -> ExportSource:
        """Return the source of its export. Raises InputError if its scene cannot be opened, Cancelled once given up."""
        if job.snapshot is None:
            self._make_scene(job)
        snapshot = job.snapshot
        assert snapshot is not None
        optics = job.optics_on(snapshot.scene)

        def draw(settings: RenderSettings) -> NDArray[Any]:
            require_size(settings.size_px)
            self._find_gloss(job, snapshot, settings)
            return self._run(job, self._draw(job, snapshot, settings))

        return ExportSource(snapshot.scene, snapshot.loaded, optics, draw, snapshot.centre)

    def report(self, job: Job, done: float, total: float, doing: str) -> None:
        """Note how far a job is, and wake the window now and then."""
        job.report(done, total, doing)
        now_s = time.perf_counter()
        if now_s - self._woken_s >= WAKE_EVERY_S:
            self._woken_s = now_s
            self._wake()

    def _make_scene(self, job: Job) -> None:
        """Read it and make its views, as far as they are needed."""
        from iibr_core.scenes.opening import results_of

        assert job.request is not None
        wanted: set[ViewOffset] | None = None
        with closing(results_of(job.request, lambda: CENTRE, lambda: wanted)) as results:
            ready = next(results)
            assert isinstance(ready, SceneReady)
            snapshot = self._run(job, _in_one_step(lambda: self._open(job, ready)))
            scene, optics = ready.scene, job.optics_on(ready.scene)
            if job.needs(scene, optics) == "scene":
                return
            wanted = views_seen_by(job.pictures(scene, optics), scene.grid)
            for made in results:
                assert isinstance(made, ViewReady)
                if (made.view.row, made.view.column) != scene.grid.centre:
                    self._run(job, _store(snapshot, made.view))
                report_progress(made.progress.done, made.progress.total, MAKING)

    def _open(self, job: Job, ready: SceneReady) -> SceneSnapshot:
        """In the window's thread, which also releases it."""
        job.snapshot = snapshot_of(self._scene_view.renderer.gl, ready)
        return job.snapshot

    def _find_gloss(self, job: Job, snapshot: SceneSnapshot, settings: RenderSettings) -> None:
        """Compute the gloss maps if they are missing."""
        request = gloss_request(settings.optics.gloss, snapshot.scene, snapshot.centre, snapshot.gloss)
        if request is None or snapshot.is_free_view:
            return
        maps = make_maps(request)
        self._run(job, _in_one_step(lambda: snapshot.take_gloss(maps)))

    def _draw(self, job: Job, snapshot: SceneSnapshot, settings: RenderSettings) -> Steps[NDArray[Any]]:
        """In the window's thread. Exports count their pictures themselves."""
        drawing = self._scene_view.renderer.start_picture(settings, snapshot.field)
        try:
            while True:
                drawing.advance(budget_s=0.0)
                if job.kind != "export":
                    job.report(drawing.progress, 1.0, DRAWING)
                if drawing.is_done:
                    return drawing.image
                yield
        finally:
            drawing.stop()

    def _run(self, job: Job, steps: Steps[Result]) -> Result:
        return self._window_work.run(steps, is_urgent=job.kind != "export")


def _store(snapshot: SceneSnapshot, view: ViewUpdate) -> Steps[None]:
    return _in_one_step(lambda: snapshot.field.upload(view.row, view.column, view.colors, view.disparity))


def _in_one_step(work: Callable[[], Result]) -> Steps[Result]:
    yield from ()
    return work()
