"""Opening of scenes in a thread: reads a scene, plans it and makes its views; each result is posted at once."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path

from iibr_core.beyond.optics import CENTRE
from iibr_core.exports.photo_folder import first_photo
from iibr_core.runtime.compiling import watch_compiling
from iibr_core.runtime.time_left import TimeLeft
from iibr_core.runtime.work import watched
from iibr_core.scenes.scene import Progress, SceneReady, SceneRequest, ViewReady
from viewer.background.newest import Failed, Post

REPORT_INTERVAL_S = 0.1
"""Time between two reports of the same work, in seconds."""


@dataclass(frozen=True)
class PhotosFound:
    """The folder of this generation holds photos, no views. path: of its first photo."""

    generation: int
    path: str


@dataclass(frozen=True, eq=False)
class WorkReport:
    """Progress of this generation's work between its results."""

    generation: int
    progress: Progress


Opened = SceneReady | ViewReady | PhotosFound | WorkReport
SceneResult = Opened | Failed[SceneRequest]


class SceneWork:
    """The work of `Newest` that opens a scene. eye: viewpoint near which views are made first, set by the window."""

    def __init__(self) -> None:
        self.eye = CENTRE

    def __call__(self, request: SceneRequest, post: Post[Opened]) -> None:
        """Post all results of a request."""
        source = Path(request.source.path)
        if source.is_dir() and (photo := first_photo(source)) is not None:
            post(PhotosFound(request.generation, str(photo)))
            return
        from iibr_core.scenes.opening import results_of

        reports = _Reports(request.generation, post)
        with watch_compiling(lambda words: reports.report(0, 0, words)), watched(reports.report):
            for result in results_of(request, lambda: self.eye):
                reports.take(result)
                post(result)


class _Reports:
    """Posts what the work is doing between its results, with the count of its views."""

    def __init__(self, generation: int, post: Post[Opened]) -> None:
        self._generation, self._post = generation, post
        self._views, self._time_left = Progress(), TimeLeft()
        self._doing, self._posted_s = "", 0.0

    def take(self, result: SceneReady | ViewReady) -> None:
        """Note the progress of the views."""
        if isinstance(result, ViewReady):
            self._views = result.progress
        else:
            self._views = Progress(total=result.scene.grid.rows * result.scene.grid.columns)

    def report(self, done: float, total: float, doing: str) -> None:
        """Post the progress, unless the same work was reported a moment ago."""
        left_s, now_s = self._time_left.update(done, total, doing), time.perf_counter()
        if doing == self._doing and now_s - self._posted_s < REPORT_INTERVAL_S:
            return
        self._doing, self._posted_s = doing, now_s
        words = f"{doing}, {round(100 * done / total)} %" if done and total else doing
        share = done / total if total else self._views.share
        self._post(WorkReport(self._generation, replace(self._views, doing=words, share=share, left_s=left_s)))
