"""Messages and counts while kernels are compiled. Light: commands import it from the start, Numba comes later."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass

COMPILING = "preparing this computer, once"
FOLDER_VARIABLE = "IIBR_KERNELS"
"""In the environment, it names the folder where compiled kernels are kept."""


@dataclass
class Compiled:
    """Kernels that this run has compiled: how many of about how many that a photo needs, and the seconds that took."""

    count: int = 0
    expected: int = 0
    seconds: float = 0.0

    @property
    def progress(self) -> tuple[int, int]:
        """Number of compiled kernels, and of all that were expected, 0 if none were."""
        return min(self.count, self.expected), self.expected


compiled = Compiled()
_listeners: list[Callable[[str], None]] = []


@contextmanager
def watch_compiling(report: Callable[[str], None]) -> Iterator[None]:
    """Call report with the message whenever a kernel is about to be compiled, in the thread that needs it."""
    _listeners.append(report)
    try:
        yield
    finally:
        _listeners.remove(report)


def report_compiling() -> None:
    """Pass the message to the newest listener, if there is one."""
    if _listeners:
        _listeners[-1](COMPILING)


def working_clock() -> float:
    """Return a time in seconds that stands still while kernels are compiled, for predictions of later work."""
    return time.perf_counter() - compiled.seconds
