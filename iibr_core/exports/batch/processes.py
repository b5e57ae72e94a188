"""Workers that are processes of this machine. They are reached by pipes that nobody else can open: no port, no socket,
no folder.
"""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import threading
from collections.abc import Callable, Iterator
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager
from queue import SimpleQueue
from typing import Any, TypeVar

from iibr_core.exports.batch.threads import QUIET_AND_SAFE, set_environment, thread_variables
from iibr_core.exports.batch.workers import MOST_DEATHS, Workers
from iibr_core.formats.files import reason_of
from iibr_core.types import InputError

SPAWN = multiprocessing.get_context("spawn")
FILES_OF_WORKER = 10
"""Pipes that a worker needs here, each with two ends."""
FILES_ELSE = 128
THREADS_OF_WORKER = 8
"""Three wait here; its own are a process, too, where the system counts them."""

Result = TypeVar("Result")


@contextmanager
def local_workers(count: int, threads: int) -> Iterator[Workers]:
    """So many processes, each with so many threads for one photo at a time. They are killed when the block ends.

    Raises InputError where none can be started.
    """
    # What is left here of others stays.
    others = set(multiprocessing.active_children())
    _allow_files(count)
    executor = _ProcessExecutor(count)
    with set_environment(thread_variables(threads) | QUIET_AND_SAFE):
        try:
            _require_start(executor, count)
            yield Workers(executor, lambda: count, BrokenProcessPool)
        finally:
            executor.stop()
            for process in set(multiprocessing.active_children()) - others:
                process.kill()
            executor.shutdown()


def _require_start(executor: Executor, count: int) -> None:
    try:
        _require_threads(THREADS_OF_WORKER * count)
        _start_resource_tracker()
        executor.submit(os.getpid).result()
    except (OSError, RuntimeError) as error:  # too many files, processes or threads; or it ended at once
        raise InputError(
            f"no worker can be started ({getattr(error, 'strerror', '') or reason_of(error)}); lower --workers, or"
            " raise the limits of memory, files (ulimit -n) and processes (ulimit -u)"
        ) from error


def _require_threads(count: int) -> None:
    """Raise RuntimeError where the system does not let so many start: pools hang where one of theirs is missing."""
    is_enough = threading.Event()
    threads = [threading.Thread(target=is_enough.wait, daemon=True) for _ in range(count)]
    started = []
    try:
        for thread in threads:
            thread.start()
            started.append(thread)
    finally:
        is_enough.set()
        for thread in started:
            thread.join()


class _Process:
    """One process, and the next one where it dies: so it is known which task it died of."""

    def __init__(self) -> None:
        self._lock = threading.Lock()
        self._pool: ProcessPoolExecutor | None = None
        self._is_stopped = False

    def run(self, work: Callable[..., Result], *arguments: Any) -> Result:
        """Raises BrokenProcessPool where the process died of this again and again, and what `work` raises."""
        for _ in range(MOST_DEATHS - 1):
            try:
                return self._run_once(work, *arguments)
            except BrokenProcessPool:
                self.end()
        return self._run_once(work, *arguments)

    def _run_once(self, work: Callable[..., Result], *arguments: Any) -> Result:
        with self._lock:
            if self._is_stopped:
                raise BrokenProcessPool("stopped")
            self._pool = self._pool or ProcessPoolExecutor(1, SPAWN, _begin_worker)
            future = self._pool.submit(work, *arguments)
        return future.result()

    def stop(self) -> None:
        """Start no process any more."""
        with self._lock:
            self._is_stopped = True

    def end(self) -> None:
        """Wait for what waits for the process, which has ended."""
        if self._pool is not None:
            self._pool.shutdown()
            self._pool = None


class _ProcessExecutor(ThreadPoolExecutor):
    """A thread for each process waits for it. Interruptions reach the main thread alone, none while a process starts:
    processes inherit that from the threads that start them.
    """

    def __init__(self, count: int) -> None:
        super().__init__(count, "iibr-worker", _block_interruption)
        self._processes = [_Process() for _ in range(count)]
        self._idle: SimpleQueue[_Process] = SimpleQueue()
        for process in self._processes:
            self._idle.put(process)

    def submit(self, work: Callable[..., Any], /, *arguments: Any) -> Any:  # type: ignore[override]
        """As any executor does."""
        return super().submit(self._run, work, *arguments)

    def stop(self) -> None:
        """Start no process any more."""
        for process in self._processes:
            process.stop()

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        """As any executor does; no threads are left of it."""
        super().shutdown(wait, cancel_futures=cancel_futures)
        for process in self._processes:
            process.end()

    def _run(self, work: Callable[..., Result], *arguments: Any) -> Result:
        process = self._idle.get()
        try:
            return process.run(work, *arguments)
        finally:
            self._idle.put(process)


def _begin_worker() -> None:
    """In a worker, before anything else. A terminal's Ctrl-C goes to every process: workers ignore it, are ended from
    above, and say nothing.
    """
    from iibr_core.runtime.machine import limit_arenas

    signal.signal(signal.SIGINT, signal.SIG_IGN)
    limit_arenas()
    threading.Thread(target=_end_with_parent, daemon=True).start()


def _end_with_parent() -> None:
    parent = multiprocessing.parent_process()
    assert parent is not None
    parent.join()
    os._exit(1)


def _start_resource_tracker() -> None:
    """Or the first worker starts it, and hears interruptions afterwards."""
    if os.name == "posix":
        from multiprocessing.resource_tracker import ensure_running

        ensure_running()


def _block_interruption() -> None:
    if hasattr(signal, "pthread_sigmask"):
        signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})


def _allow_files(workers: int) -> None:
    """Raise this process's own limit of open files as far as so many workers need it and the system allows."""
    if sys.platform == "win32":
        return
    import resource

    soft, hard = resource.getrlimit(resource.RLIMIT_NOFILE)
    needed = FILES_OF_WORKER * workers + FILES_ELSE
    most = needed if hard == resource.RLIM_INFINITY else min(needed, hard)
    if soft != resource.RLIM_INFINITY and soft < most:
        resource.setrlimit(resource.RLIMIT_NOFILE, (most, hard))
