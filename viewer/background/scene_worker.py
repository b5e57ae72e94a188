"""The worker thread: reads a scene, plans it and makes its views, and hands each result over as soon as it is there.

The newest request wins: the job before it stops at its next row band, see `viewer.background.job_threads`.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

from iibr_core.exports.photo_folder import first_photo
from iibr_core.formats.files import is_folder
from iibr_core.rendering.optics import CENTRE
from iibr_core.runtime.compiling import watch_compiling
from iibr_core.scenes.opening import SceneReady, SceneRequest, ViewReady, results_of
from iibr_core.scenes.scene import Progress
from iibr_core.types import ViewOffset
from viewer.background.job_threads import Failed, Job, JobThread, ProgressReport


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
        def report_progress(progress: Progress) -> None:
            job.post(ProgressReport(job.request.generation, progress))

        source = Path(job.request.source.path)
        if is_folder(source) and (photo := first_photo(source)) is not None:
            return iter((PhotosFound(job.request.generation, str(photo)),))
        if self._scene_work is not None:
            return iter(self._scene_work(job.request, lambda: self.eye))
        results = results_of(job.request, lambda: self.eye, report_progress)
        return _telling_compiling(results, report_progress)


def _telling_compiling(
    results: Iterator[SceneReady | ViewReady], report_progress: Callable[[Progress], None]
) -> Iterator[SceneReady | ViewReady]:
    """The same results; meanwhile, kernels that must be compiled are told beside what is there, with the time that this
    takes.
    """
    there = Progress()
    with watch_compiling(lambda words: report_progress(replace(there, doing=words, left_s=None))):
        for result in results:
            if isinstance(result, ViewReady):
                there = result.progress
            else:
                there = Progress(total=result.scene.grid.rows * result.scene.grid.columns)
            yield result


def _failure(request: SceneRequest, message: str) -> Failed[int]:
    return Failed(request.generation, message)
