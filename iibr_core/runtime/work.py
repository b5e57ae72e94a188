"""Cancellation of a job: set where the job begins, asked wherever it works, handed on to its threads."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from typing import ParamSpec, TypeVar

ShouldStop = Callable[[], bool]
Parameters = ParamSpec("Parameters")
Result = TypeVar("Result")


class Cancelled(Exception):
    """The job was stopped."""


def never() -> bool:
    """Return False: the job is never stopped."""
    return False


_should_stop: ContextVar[ShouldStop] = ContextVar("should_stop", default=never)


@contextmanager
def stoppable(should_stop: ShouldStop) -> Iterator[None]:
    """Run the block as a job that stops, by raising Cancelled, soon after should_stop returns true."""
    token = _should_stop.set(should_stop)
    try:
        yield
    finally:
        _should_stop.reset(token)


def is_stopped() -> bool:
    """Return whether the present job is to stop."""
    return _should_stop.get()()


def raise_if_stopped() -> None:
    """Raise Cancelled if the present job is to stop."""
    if is_stopped():
        raise Cancelled


def in_this_job(function: Callable[Parameters, Result], or_when: ShouldStop = never) -> Callable[Parameters, Result]:
    """Return a function that does the same in another thread, as part of the present job.

    or_when: stops it, too.
    """
    should_stop = _should_stop.get()

    def run(*arguments: Parameters.args, **named: Parameters.kwargs) -> Result:
        with stoppable(lambda: or_when() or should_stop()):
            return function(*arguments, **named)

    return run
