"""Files read and written beside the window, one after the other, in the order in which they were asked for."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from viewer.background.job_threads import Failed, Job, JobThread


@dataclass(frozen=True, eq=False)
class FileRequest:
    """A file to read or to write. work: does it, its inputs bound to it; what it returns comes back as `Done`."""

    id: int
    work: Callable[[], Any]


@dataclass(frozen=True, eq=False)
class Done:
    """What the work of this request returned."""

    id: int
    value: Any


FileResult = Done | Failed[int]


class FileWorker(JobThread[FileRequest, FileResult]):
    """Carries every request out, however many wait."""

    def __init__(self, name: str, wake: Callable[[], None]) -> None:
        super().__init__(name, wake, _results_of, lambda asked, message: Failed(asked.id, message), newest_wins=False)


def _results_of(job: Job[FileRequest, FileResult]) -> Iterator[FileResult]:
    yield Done(job.request.id, job.request.work())
