"""The worker thread: reads a scene, plans it and makes its views, and hands each result over as soon as it is there.

The newest request wins: the job before it stops at its next row band, see `viewer.background.job_threads`.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from iibr_core.beyond.optics import CENTRE
from iibr_core.exports.photo_folder import first_photo
from iibr_core.runtime.compiling import watch_compiling
from iibr_core.runtime.time_left import TimeLeft
from iibr_core.runtime.work import watched
from iibr_core.scenes.scene import Progress, SceneReady, SceneRequest, ViewReady
from iibr_core.types import ViewOffset
from viewer.background.job_threads import Failed, Job, JobThread, ProgressReport

REPORT_EVERY_S = 0.1
"""Seconds between two reports of the same work."""


@dataclass(frozen=True)
class PhotosFound:
    """The folder asked for is none of views but of photos; path: of the first."""

    generation: int
    path: str


SceneResult = SceneReady | ViewReady | PhotosFound | ProgressReport[int] | Failed[int]
SceneWork = Callable[[SceneRequest, Callable[[], ViewOffset]], Iterator[SceneReady | ViewReady]]
"""What a job does: (request, where the user looks) -> its results, in order. See `results_of`."""


class SceneWorker(JobThread[SceneRequest, SceneResult]):
    """Carries out the newest request. Results are distinguished by the generation of their request.

    eye: where the user looks now; views near it are made first. Set by the window, read by the job.
    """

    def __init__(self, wake: Callable[[], None], work: SceneWork | None = None) -> None:
        """wake: called, in the thread, when a result was posted. work: what a job does, `results_of` by default."""
        super().__init__("iibr-scene", wake, self._carry_out_scene, _failure)
        self.eye = CENTRE
        self._scene_work = work

    def _carry_out_scene(self, job: Job[SceneRequest, SceneResult]) -> Iterator[SceneResult]:
        source = Path(job.request.source.path)
        if source.is_dir() and (photo := first_photo(source)) is not None:
            yield PhotosFound(job.request.generation, str(photo))
            return
        if self._scene_work is not None:
            yield from self._scene_work(job.request, lambda: self.eye)
            return
        from iibr_core.scenes.opening import results_of

        reports = _Reports(job)
        with watch_compiling(lambda words: reports.report(0, 0, words)), watched(reports.report):
            for result in results_of(job.request, lambda: self.eye):
                reports.take(result)
                yield result


class _Reports:
    """Posts what a job reports while it has no result, beside the progress of its views."""

    def __init__(self, job: Job[SceneRequest, SceneResult]) -> None:
        self._job, self._there, self._time_left = job, Progress(), TimeLeft()
        self._doing, self._told_s = "", 0.0

    def take(self, result: SceneReady | ViewReady) -> None:
        """Note the progress of the views."""
        if isinstance(result, ViewReady):
            self._there = result.progress
        else:
            self._there = Progress(total=result.scene.grid.rows * result.scene.grid.columns)

    def report(self, done: float, total: float, doing: str) -> None:
        """Post what the job is doing, unless the same was posted a moment ago."""
        left_s, now_s = self._time_left.update(done, total, doing), time.perf_counter()
        if doing == self._doing and now_s - self._told_s < REPORT_EVERY_S:
            return
        self._doing, self._told_s = doing, now_s
        words = f"{doing}, {done / total:.0%}" if done and total else doing
        share = done / total if total else self._there.share
        progress = replace(self._there, doing=words, share=share, left_s=left_s)
        self._job.post(ProgressReport(self._job.request.generation, progress))


def _failure(request: SceneRequest, message: str) -> Failed[int]:
    return Failed(request.generation, message)
