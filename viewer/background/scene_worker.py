"""Opening of scenes in a thread: reads a scene, plans it and makes its views; each result is posted at once."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from pathlib import Path

from iibr_core.exports.photo_folder import first_photo
from iibr_core.runtime.compiling import compiled, watch_compiling
from iibr_core.runtime.time_left import TimeLeft
from iibr_core.runtime.work import watched
from iibr_core.scenes.scene import Progress, SceneReady, SceneRequest, ViewReady
from iibr_core.types import CENTRE
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
        """Post all results of a request, and reports of the work between them with the count of its views."""
        source = Path(request.source.path)
        if source.is_dir() and (photo := first_photo(source)) is not None:
            post(PhotosFound(request.generation, str(photo)))
            return
        from iibr_core.scenes.opening import results_of

        views, time_left, posted, posted_s = Progress(), TimeLeft(), "", 0.0

        def report(done: float, total: float, doing: str) -> None:
            nonlocal posted, posted_s
            left_s, now_s = time_left.update(done, total, doing), time.perf_counter()
            if doing == posted and now_s - posted_s < REPORT_INTERVAL_S:
                return
            posted, posted_s = doing, now_s
            words = f"{doing}, {round(100 * done / total)} %" if done and total else doing
            share = done / total if total else 0.0 if views.doing else views.share
            left_s = left_s if done < total else None  # a stage that takes longer than expected
            post(WorkReport(request.generation, replace(views, doing=words, share=share, left_s=left_s)))

        with watch_compiling(lambda words: report(*compiled.progress, words)), watched(report):
            for result in results_of(request, lambda: self.eye):
                views = result.progress if isinstance(result, ViewReady) else Progress(total=result.scene.view_count)
                post(result)
