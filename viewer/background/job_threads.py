"""How all background work is asked for and answered: frozen requests in, frozen results out, one thread a kind of work.

A request carries all its inputs, so there is nothing to lock. What a cancelled job still had to say is dropped. Heavy
imports happen in the thread, so the window comes first.
"""

from __future__ import annotations

import queue
import threading
import traceback
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Generic, TypeVar

from iibr_core.runtime.machine import give_back_memory
from iibr_core.runtime.work import stoppable
from iibr_core.scenes.scene import Progress
from iibr_core.types import InputError
from viewer.model.remedies import words_of

QUEUED_RESULTS = 8
"""Results that may wait for the window: enough to keep a thread busy, few enough to cost no memory."""

POST_RETRY_S = 0.02

Request = TypeVar("Request")
Result = TypeVar("Result")
Id = TypeVar("Id")


@dataclass(frozen=True, eq=False)
class ProgressReport(Generic[Id]):
    """What the request of this id is busy with before there is a result."""

    id: Id
    progress: Progress


@dataclass(frozen=True)
class Failed(Generic[Id]):
    """The request of this id came to nothing; the message is one line for people."""

    id: Id
    message: str


class Job(Generic[Request, Result]):
    """A request under way, as its work sees it."""

    def __init__(self, request: Request, thread: JobThread[Request, Result]) -> None:
        self.request = request
        self._thread = thread
        self._round = thread.round

    def should_stop(self) -> bool:
        """Whether nobody wants its results any more; asked often, between bands of rows."""
        return self._round != self._thread.round

    def post(self, result: Result) -> None:
        """Hand a result over and wake the window; waits while the queue is full."""
        self._thread.post(self, result)


Work = Callable[[Job[Request, Result]], Iterator[Result]]
"""What a request comes to: its results, in order. Raises InputError, or Cancelled once the job should stop."""


class JobThread(Generic[Request, Result]):
    """A thread that carries requests out, one at a time; it starts with the first.

    is_lost: whether the thread ended unasked; the next request starts another one. round: how often it was cancelled.
    """

    def __init__(
        self,
        name: str,
        wake: Callable[[], None],
        work: Work[Request, Result],
        failure: Callable[[Request, str], Result],
        newest_wins: bool = True,
    ) -> None:
        """wake: called, in the thread, when a result was posted. failure: the result that says what went wrong.

        newest_wins: a request cancels those before it; else it waits for them.
        """
        self.is_lost = False
        self.round = 0
        self._name, self._wake, self._work, self._failure = name, wake, work, failure
        self._newest_wins = newest_wins
        self._pending: queue.SimpleQueue[Job[Request, Result] | None] = queue.SimpleQueue()
        self._results: queue.Queue[tuple[Job[Request, Result], Result]] = queue.Queue(QUEUED_RESULTS)
        self._is_closing = False
        self._thread: threading.Thread | None = None

    def submit(self, request: Request) -> None:
        """Have this carried out. A lost thread is replaced."""
        if self._newest_wins:
            self.cancel()
        self._pending.put(Job(request, self))
        if self._thread is None or self.is_lost:
            self._start_thread()

    def cancel(self) -> None:
        """Stop every job; nothing more is heard of them."""
        self.round += 1

    def next_result(self) -> Result | None:
        """The next result, or None. Those of cancelled jobs are dropped here."""
        while True:
            try:
                job, result = self._results.get_nowait()
            except queue.Empty:
                return None
            if not job.should_stop():
                return result

    def close(self, cancels: bool = True) -> None:
        """Wait for the thread to end. cancels: the jobs, instead of carrying them out to the end."""
        if cancels:
            self.cancel()
        self._is_closing = True
        self._pending.put(None)
        if self._thread is not None:
            self._thread.join()

    def post(self, job: Job[Request, Result], result: Result) -> None:
        """Queue a result of a job and wake the window, unless nobody wants it by then."""
        while not (job.should_stop() or self._is_closing):
            try:
                self._results.put((job, result), timeout=POST_RETRY_S)
            except queue.Full:
                continue
            self._wake()
            return

    def _start_thread(self) -> None:
        if self._thread is not None:
            self._thread.join()
        self.is_lost = False
        self._thread = threading.Thread(target=self._run_and_wake, name=self._name, daemon=True)
        self._thread.start()

    def _run_and_wake(self) -> None:
        try:
            while self._carry_out(self._pending.get()):
                pass
        except BaseException:  # the window says so and goes on; the trace is for whoever mends it
            traceback.print_exc()
            self.is_lost = True
            self._wake()

    def _carry_out(self, job: Job[Request, Result] | None) -> bool:
        """False where there is nothing more to do. Nothing of a job is kept: its inputs may be large."""
        if job is None or job.should_stop():
            return job is not None
        try:
            with stoppable(job.should_stop):
                for result in self._work(job):
                    job.post(result)
                    if job.should_stop():
                        break
        except Exception as error:  # the one place where a job's error can still be shown to the user
            job.post(self._failure(job.request, message_of(error)))
        finally:
            give_back_memory()
        return True


def message_of(error: Exception) -> str:
    """One line for people: an input error speaks for itself, any other says what kind it is."""
    text = " ".join(words_of(error).split())
    return text if isinstance(error, InputError) else f"{type(error).__name__}: {text or 'no message'}"
