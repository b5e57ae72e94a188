"""A gloss on the scene that is open: where the scene's surfaces lie, what is reflected, and its views with it."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress

from iibr_core.rendering.gloss import Gloss
from iibr_core.runtime import Cancelled
from iibr_core.scenes import GlossFound, GlossRequest, answer
from viewer.background.jobs import Failed, Job, JobThread

GlossResult = GlossFound | Failed[Gloss]


class GlossWorker(JobThread[GlossRequest, GlossResult]):
    """Finds out beside the window what a gloss means; the newest request wins."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """wake: called, in the thread, when a result was posted."""
        super().__init__("iibr-gloss", wake, _results_of, lambda asked, message: Failed(asked.gloss, message))


def _results_of(job: Job[GlossRequest, GlossResult]) -> Iterator[GlossResult]:
    with suppress(Cancelled):
        yield answer(job.request, job.should_stop)
