"""Cancellation and progress of a job: set where the job begins, used wherever it works, handed on to its threads."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from concurrent.futures import Future, wait
from contextlib import contextmanager
from contextvars import ContextVar
from typing import ParamSpec, TypeVar

ShouldStop = Callable[[], bool]
ReportProgress = Callable[[float, float, str], None]
"""Function of (done, total, doing): amounts of work, the total 0 if it is unknown; and the work in words."""
POLL_S = 0.05
"""Seconds between two looks whether a job that waits for another thread is to stop."""
Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


class Cancelled(Exception):
    """The job was stopped."""


def never() -> bool:
    """Return False: the job is never stopped."""
    return False


def ignore_progress(done: float, total: float, doing: str) -> None:
    """Do nothing with the progress of a job."""


_should_stop: ContextVar[ShouldStop] = ContextVar("should_stop", default=never)
_report: ContextVar[ReportProgress] = ContextVar("report_progress", default=ignore_progress)


@contextmanager
def stoppable(should_stop: ShouldStop) -> Iterator[None]:
    """Run the block as a job that stops, by raising Cancelled, soon after should_stop returns true."""
    token = _should_stop.set(should_stop)
    try:
        yield
    finally:
        _should_stop.reset(token)


@contextmanager
def watched(report: ReportProgress) -> Iterator[None]:
    """Run the block as a job whose progress goes to `report`, in whatever thread works."""
    token = _report.set(report)
    try:
        yield
    finally:
        _report.reset(token)


@contextmanager
def part_of_job(before: float, work: float, total: float) -> Iterator[None]:
    """Count the progress of the block as `work` of the job's `total`, after `before`."""
    report = _report.get()

    def report_part(done: float, of_part: float, doing: str) -> None:
        report(before + (work * done / of_part if of_part else 0.0), total, doing)

    with watched(report_part):
        yield


def is_stopped() -> bool:
    """Return whether the present job is to stop."""
    return _should_stop.get()()


def raise_if_stopped() -> None:
    """Raise Cancelled if the present job is to stop."""
    if is_stopped():
        raise Cancelled


def wait_unless_stopped(running: Future[Result]) -> Result:
    """Return the result of work in another thread. Raises Cancelled if the present job is to stop before."""
    while not wait([running], POLL_S).done:
        raise_if_stopped()
    return running.result()


def report_progress(done: float, total: float, doing: str) -> None:
    """Report the progress of the present job, see `ReportProgress`."""
    _report.get()(done, total, doing)


def in_this_job(function: Callable[Parameters, Result], or_when: ShouldStop = never) -> Callable[Parameters, Result]:
    """Return a function that does the same in another thread, as part of the present job.

    or_when: stops it, too.
    """
    should_stop, report = _should_stop.get(), _report.get()

    def run(*arguments: Parameters.args, **named: Parameters.kwargs) -> Result:
        with stoppable(lambda: or_when() or should_stop()), watched(report):
            return function(*arguments, **named)

    return run
