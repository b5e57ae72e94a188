"""Photos handed to worker processes by Dask: on this machine, or those of a scheduler that runs elsewhere.

So many are in flight as there are threads for them, no more: a hundred thousand photos take no room here, and where a
worker dies, only what it was working at is suspected of it.
"""

from __future__ import annotations

import asyncio
import logging
import signal
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from multiprocessing.resource_tracker import ensure_running
from typing import Any

import dask
from distributed import Client, LocalCluster, as_completed
from distributed.scheduler import KilledWorker
from distributed.utils import LoopRunner

from iibr_core.types import InputError
from viewer.app.batch.task import BatchSettings, Outcome, PhotoTask
from viewer.app.batch.threads import ThreadsOfWorker
from viewer.app.batch.work import export_photo, warm_up

ALLOWED_FAILURES = 2
"""Workers that a photo may take along before it is given up."""
CONNECT_S = 30
LOCAL_CONFIG = {
    "distributed.scheduler.allowed-failures": ALLOWED_FAILURES,
    # Nothing is kept between photos that could be spilled, and a paused worker would never go on.
    "distributed.worker.memory.target": False,
    "distributed.worker.memory.spill": False,
    "distributed.worker.memory.pause": False,
    # Dask has the allocator give back whatever is freed: every array is paged in anew, a photo takes twice the time.
    "distributed.nanny.pre-spawn-environ": {"OMP_NUM_THREADS": 1, "MKL_NUM_THREADS": 1, "OPENBLAS_NUM_THREADS": 1},
}


@contextmanager
def local_workers(count: int, threads: int) -> Iterator[Client]:
    """So many processes on this machine, each with so many threads for one photo at a time."""
    with dask.config.set(LOCAL_CONFIG), _loop_deaf_to_interruption() as loop:
        cluster = LocalCluster(
            n_workers=count, threads_per_worker=1, dashboard_address=None, silence_logs=logging.CRITICAL, loop=loop
        )
        try:
            with Client(cluster) as client:
                client.register_plugin(ThreadsOfWorker(threads))
                yield client
        finally:
            cluster.close()


@contextmanager
def _loop_deaf_to_interruption() -> Iterator[Any]:
    """The event loop whose threads start the workers. A terminal's Ctrl-C goes to every process: workers inherit that
    it does not reach them, are ended from here, and say nothing.
    """
    runner = LoopRunner()
    ensure_running()  # the first process that is started would start it, and hear interruptions again afterwards
    signals = {signal.SIGINT} if hasattr(signal, "pthread_sigmask") else set()
    if signals:
        signal.pthread_sigmask(signal.SIG_BLOCK, signals)
    try:
        runner.start()
    finally:
        if signals:
            signal.pthread_sigmask(signal.SIG_UNBLOCK, signals)
    try:
        yield runner.loop
    finally:
        runner.stop()


@contextmanager
def _silent() -> Iterator[None]:
    """What goes wrong is said once, in our words. Each of Dask's loggers has a level of its own."""
    before = logging.root.manager.disable
    logging.disable(logging.CRITICAL)
    try:
        yield
    finally:
        logging.disable(before)


@contextmanager
def remote_workers(address: str) -> Iterator[Client]:
    """Those of a scheduler; a photo takes one of a worker's threads. Raises InputError where it cannot be reached."""
    with _silent():
        try:
            client = Client(address, timeout=CONNECT_S)
        except (OSError, ValueError) as error:
            raise InputError(f"{address}: no Dask scheduler answers there; start one with: dask scheduler") from error
        with client:
            try:
                client.wait_for_workers(1, timeout=CONNECT_S)
            except TimeoutError as error:
                raise InputError(
                    f"{address}: the scheduler has no workers; start some: dask worker {address}"
                ) from error
            client.register_plugin(ThreadsOfWorker(1))
            try:
                yield client
            finally:
                with suppress(Exception):  # it may be gone
                    client.unregister_worker_plugin(ThreadsOfWorker.name)


def warm_workers(client: Client, settings: BatchSettings, memory_bytes: int | None) -> None:
    """Let every worker do all that only the first photo would wait for."""
    warm = partial(warm_up, settings, memory_bytes)
    client.gather([client.submit(warm, workers=[address], pure=False) for address in client.nthreads()], errors="skip")


def outcomes_of(
    client: Client, tasks: Iterable[PhotoTask], work: Callable[[PhotoTask], Outcome] = export_photo
) -> Iterator[tuple[PhotoTask, Outcome]]:
    """Each task with its outcome, as they come; tasks are taken from the iterable when there is a thread for them.

    Raises InputError where the scheduler goes away.
    """
    waiting, running = iter(tasks), as_completed()
    task_of: dict[Any, PhotoTask] = {}

    def submit() -> None:
        free = max(sum(client.nthreads().values()), 1) - len(task_of)
        for _, task in zip(range(free), waiting):
            future = client.submit(work, task, key=f"iibr-{task.key}", pure=False)
            task_of[future] = task
            running.add(future)

    try:
        submit()
        while task_of:
            future = next(running)
            task = task_of.pop(future)
            yield task, _outcome(future)
            del future
            submit()
    except (InputError, GeneratorExit):
        raise
    except (Exception, asyncio.CancelledError) as error:  # whatever Dask says where nobody answers any more
        raise _lost(error) from error


def _outcome(future: Any) -> Outcome:
    error = future.exception()
    if error is None:
        outcome: Outcome = future.result()
        return outcome
    if isinstance(error, KilledWorker):
        return Outcome(reason=f"killed its worker, {ALLOWED_FAILURES + 1} times: too little memory, or a fault")
    raise _lost(error)


def _lost(error: BaseException) -> InputError:
    return InputError(f"the workers were lost ({type(error).__name__}); give the same command again, and it goes on")
