"""Photos handed to workers by way of `concurrent.futures.Executor`: processes of this machine, or a Dask scheduler's.

Only as many photos are in flight as there are workers: a hundred thousand photos need no memory here, and when a worker
dies, only the photos in flight are suspected.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import FIRST_COMPLETED, Executor, Future, wait
from contextlib import AbstractContextManager
from itertools import islice
from typing import NamedTuple

from iibr_core.exports.batch.task import Outcome, PhotoTask
from iibr_core.formats.files import reason_of
from iibr_core.types import InputError

MOST_DEATHS = 3
"""Workers that may die of one photo before it is given up."""


class Workers(NamedTuple):
    """capacity: photos they take at the same time. death: what a future raises whose task was given up for its workers
    died.
    """

    executor: Executor
    capacity: Callable[[], int]
    death: type[BaseException]


class WorkerSource(NamedTuple):
    """Where workers come from. open: starts or finds them, raises InputError. memory_bytes: the share of each, None for
    what it finds itself.
    """

    open: Callable[[], AbstractContextManager[Workers]]
    memory_bytes: int | None


def outcomes_of(
    workers: Workers, tasks: Iterable[PhotoTask], work: Callable[[PhotoTask], Outcome]
) -> Iterator[tuple[PhotoTask, Outcome]]:
    """Each task with its outcome, as they come; tasks are taken from the iterable when a worker is free for them.

    Raises InputError where the workers are lost.
    """
    waiting = iter(tasks)
    running: dict[Future[Outcome], PhotoTask] = {}
    while True:
        for task in islice(waiting, max(_capacity_of(workers), 1) - len(running)):
            running[_submit(workers, work, task)] = task
        if not running:
            return
        for future in wait(running, return_when=FIRST_COMPLETED).done:
            yield running.pop(future), _outcome(future, workers.death)


def _capacity_of(workers: Workers) -> int:
    try:
        return workers.capacity()
    except Exception as error:  # whatever Dask raises where nobody answers
        raise _lost(error) from error


def _submit(workers: Workers, work: Callable[[PhotoTask], Outcome], task: PhotoTask) -> Future[Outcome]:
    try:
        return workers.executor.submit(work, task)
    except Exception as error:
        raise _lost(error) from error


def _outcome(future: Future[Outcome], death: type[BaseException]) -> Outcome:
    try:
        return future.result()
    except InputError:
        raise
    except death as error:
        # A scheduler elsewhere counts in its own way.
        deaths = 1 + getattr(error, "allowed_failures", MOST_DEATHS - 1)
        return Outcome(reason=f"killed its worker, {deaths} times: too little memory, or a fault")
    except Exception as error:  # CancelledError is one
        raise _lost(error) from error


def _lost(error: Exception) -> InputError:
    return InputError(f"the workers were lost ({reason_of(error)}); give the same command again, and it continues")
