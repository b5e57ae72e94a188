"""Background work whose newest request wins: frozen requests in, results out, one thread a kind of work.

A request carries all its inputs, so nothing is shared. Heavy imports happen in the thread, so the window comes first.
"""

from __future__ import annotations

import queue
import threading
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any, Generic, TypeVar

from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.types import InputError
from viewer.model import messages
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.messages import Notice
from viewer.model.remedies import words_of

MAX_WAITING_RESULTS = 8
"""Number of results that may wait for the window: enough to keep a thread busy, few enough to need little memory."""
POST_RETRY_S = 0.02

Request = TypeVar("Request")
Result = TypeVar("Result")
Post = Callable[[Result], None]
Work = Callable[[Request, Post[Result]], None]
"""Carries out a request and posts its results, in order. Raises InputError; posting raises Cancelled once the request
is no longer the newest."""


@dataclass(frozen=True, eq=False)
class Failed(Generic[Request]):
    """A request that failed; message: one line for people."""

    request: Request
    message: str


class Newest(Generic[Request, Result]):
    """A thread that carries out the newest request. It starts with the first request."""

    def __init__(self, name: str, work: Work[Request, Result], wake: Callable[[], None]) -> None:
        """wake: called, in the thread, when a result was posted."""
        self._name, self._work, self._wake = name, work, wake
        self._number = 0
        self._requests: queue.SimpleQueue[tuple[int, Request] | None] = queue.SimpleQueue()
        self._results: queue.Queue[tuple[int, Result | Failed[Request]]] = queue.Queue(MAX_WAITING_RESULTS)
        self._thread: threading.Thread | None = None

    def submit(self, request: Request) -> None:
        """Carry out this request instead of all earlier ones."""
        self.cancel()
        self._requests.put((self._number, request))
        if self._thread is None:
            self._thread = threading.Thread(target=self._run, name=self._name, daemon=True)
            self._thread.start()

    def cancel(self) -> None:
        """Stop all requests and drop their results."""
        self._number += 1

    def next_result(self) -> Result | Failed[Request] | None:
        """Return the next result of the newest request, None where there is none yet."""
        while True:
            try:
                number, result = self._results.get_nowait()
            except queue.Empty:
                return None
            if number == self._number:
                return result

    def close(self) -> None:
        """Stop all requests and wait for the thread to end."""
        self.cancel()
        self._requests.put(None)
        if self._thread is not None:
            self._thread.join()

    def _run(self) -> None:
        while (item := self._requests.get()) is not None:
            self._carry_out(*item)

    def _carry_out(self, number: int, request: Request) -> None:
        def post(result: Result | Failed[Request]) -> None:
            self._post(number, result)

        try:
            with stoppable(lambda: number != self._number):
                self._work(request, post)
        except Cancelled:
            return
        except Exception as error:  # the only place where an error of the work can still be shown to a person
            with suppress(Cancelled):
                post(Failed(request, message_of(error)))

    def _post(self, number: int, result: Result | Failed[Request]) -> None:
        """Queue a result and wake the window; wait while the queue is full. Raises Cancelled."""
        while number == self._number:
            try:
                self._results.put((number, result), timeout=POST_RETRY_S)
            except queue.Full:
                continue
            self._wake()
            return
        raise Cancelled


def message_of(error: Exception) -> str:
    """Return an error as one line for people, with its kind unless it is an input error."""
    text = " ".join(words_of(error).split())
    return text if isinstance(error, InputError) else f"{type(error).__name__}: {text or 'no message'}"


def noting(*consequences: Action) -> Callable[[Failed[Any]], list[Action]]:
    """Return the function from a failure to the notice that shows it and these actions."""
    return lambda failed: [do(messages.notify, Notice(failed.message, is_error=True)), *consequences]


class Finder(Generic[Request, Result]):
    """Finds what the state asks for; equal requests are carried out once, one that it no longer asks for is stopped."""

    def __init__(
        self,
        newest: Newest[Request, Result],
        request_for: Callable[[AppState], Request | None],
        take: Callable[[Result], Sequence[Action] | None],
        fail: Callable[[Failed[Request]], Sequence[Action]] | None = None,
    ) -> None:
        """request_for: returns the request of a state. take: shows a result. fail: returns what follows a failure, for
        None a notice.
        """
        self._asked: Request | None = None
        self._newest, self._request_for, self._take, self._fail = newest, request_for, take, fail or noting()
        self.close = newest.close

    def advance(self, state: AppState) -> list[Action]:
        """Show new results, report failures, and begin the request of the state."""
        actions: list[Action] = []
        while (result := self._newest.next_result()) is not None:
            actions += self._fail(result) if isinstance(result, Failed) else self._take(result) or ()
        request, before = self._request_for(state), self._asked
        self._asked = request
        if request is None:
            self._newest.cancel()
        elif request != before:
            self._newest.submit(request)
        return actions
