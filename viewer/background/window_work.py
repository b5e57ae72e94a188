"""Work that other threads hand to the window's thread, which does it in steps between its frames."""

from __future__ import annotations

import queue
import time
from collections.abc import Callable, Generator
from concurrent.futures import Future, wait
from dataclasses import dataclass, field
from typing import Any, TypeVar

from iibr_core.runtime.work import ShouldStop, in_this_job, is_stopped, raise_if_stopped

LOOK_S = 0.05
"""Time between two looks of a waiting thread whether its job was stopped, in seconds."""

Result = TypeVar("Result")
Steps = Generator[None, None, Result]
"""Work in steps; the generator returns the result."""


@dataclass(eq=False)
class _Asked:
    """Steps from another thread, and what comes of them."""

    steps: Steps[Any]
    should_stop: ShouldStop
    is_urgent: bool
    future: Future[Any] = field(default_factory=Future)


class WindowWork:
    """`run` is called by other threads, everything else by the thread of the window."""

    def __init__(self, wake: Callable[[], None]) -> None:
        """wake: called, in the thread that asks, when there is something to do."""
        self._wake = wake
        self._new: queue.SimpleQueue[_Asked] = queue.SimpleQueue()
        self._asked: list[_Asked] = []

    @property
    def is_waiting(self) -> bool:
        """Whether `advance` has something to do."""
        return bool(self._asked) or not self._new.empty()

    def run(self, steps: Steps[Result], is_urgent: bool = False) -> Result:
        """Wait until the window's thread has taken all steps; return their result.

        is_urgent: whether they come before others. Raises what the steps raise, and Cancelled once the job is stopped.
        """
        asked = _Asked(steps, in_this_job(is_stopped), is_urgent)
        self._new.put(asked)
        self._wake()
        while not wait([asked.future], LOOK_S).done:
            raise_if_stopped()
        result: Result = asked.future.result()
        return result

    def advance(self, budget_s: float) -> None:
        """Take steps for about that long, at least one."""
        end = time.perf_counter() + budget_s
        self.forget_stopped()
        while self._asked:
            self._step(min(self._asked, key=lambda asked: not asked.is_urgent))
            if time.perf_counter() >= end:
                return

    def forget_stopped(self) -> None:
        """Close the steps of jobs that should stop."""
        while not self._new.empty():
            self._asked.append(self._new.get())
        for stopped in [asked for asked in self._asked if asked.should_stop()]:
            stopped.steps.close()
            self._asked.remove(stopped)

    def _step(self, asked: _Asked) -> None:
        try:
            next(asked.steps)
            return
        except StopIteration as end:
            asked.future.set_result(end.value)
        except Exception as error:  # raised in the thread that asked
            asked.future.set_exception(error)
        self._asked.remove(asked)
