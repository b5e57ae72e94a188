"""What people are told who wait for kernels: where none came along that fit, the first run compiles them.

Light: commands have it from the start, Numba comes later.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager

from iibr_core.runtime.time_left import TimeLeft, about_left

KERNELS_OF_A_PHOTO = 265
"""Compiled until all views of one with a map are there, those inside others included."""
COMPILING = "compiling for this computer, once"

Tell = Callable[[str], None]


class _FirstRun:
    """count: of kernels compiled in this process. has_some: whether one came along compiled."""

    def __init__(self) -> None:
        self.count = 0
        self.has_some = False
        self.tell: Tell | None = None
        self._time_left = TimeLeft()

    def words(self) -> str:
        """How far it is, for people."""
        left_s = self._time_left.update(self.count, max(KERNELS_OF_A_PHOTO, self.count + 1))
        words = f"{COMPILING}, {self._time_left.share:.0%}"
        return f"{words}, {about_left(left_s)}" if left_s else words


_first_run = _FirstRun()


@contextmanager
def tell_compiling(tell: Tell) -> Iterator[None]:
    """Within the block, tell gets a line whenever a kernel is about to be compiled and none came along; it is called in
    whatever thread needs the kernel.
    """
    before, _first_run.tell = _first_run.tell, tell
    try:
        yield
    finally:
        _first_run.tell = before


def note_kernel(came_along: bool) -> None:
    """One was found that came along, or has to be compiled now."""
    run = _first_run
    run.has_some |= came_along
    if run.has_some:
        return
    words = run.words()
    run.count += 1
    if run.tell is not None:
        run.tell(words)
