"""Ctrl-C and SIGTERM while a window is open: its loop ends between two turns.

Python raises KeyboardInterrupt wherever the program is at that time, also in a callback of GLFW, where it is lost.
"""

from __future__ import annotations

import signal
from collections.abc import Iterator
from contextlib import contextmanager
from types import FrameType


@contextmanager
def interruptions() -> Iterator[list[int]]:
    """Yield the signals that came within the block.

    Raises KeyboardInterrupt at its end if one came, and at once when a second one comes.
    """
    came: list[int] = []

    def note(number: int, frame: FrameType | None) -> None:
        if came:
            signal.default_int_handler(number, frame)
        came.append(number)

    handled = (signal.SIGINT, signal.SIGTERM)
    numbers = [number for number in handled if signal.getsignal(number) is signal.default_int_handler]
    for number in numbers:
        signal.signal(number, note)
    try:
        yield came
    finally:
        for number in numbers:
            signal.signal(number, signal.default_int_handler)
    if came:
        raise KeyboardInterrupt
