"""The message while kernels are compiled. Light: commands import it from the start, Numba comes later."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

COMPILING = "compiling kernels for this computer, once"
FOLDER_VARIABLE = "IIBR_KERNELS"
"""In the environment, it names the folder where compiled kernels are kept."""

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
