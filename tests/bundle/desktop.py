"""The screen on which programs of another system, or of the checkout, show their windows, one after the other."""

from __future__ import annotations

import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager

import numpy as np
from numpy.typing import NDArray
from PIL import ImageGrab

from tests.bundle.systems import CACHE
from tests.image_compare import write_png

DEADLINE_S = 120.0
STILL_S = 3.0
"""Time after which a picture that stays the same is taken for the last, in seconds."""
POLL_S = 0.05
CORNER = 1399, 899
"""Place beside the windows, in pixels of the screen."""
FAILED = CACHE / "failed.png"
"""Picture of the screen where a condition did not come true."""
SEARCH = "xdotool search --onlyvisible --class ^iibr$ getwindowname %@"
Picture = NDArray[np.uint8]
Program = subprocess.Popen[bytes]


def send(*words: object) -> None:
    """Move the pointer and press keys by xdotool."""
    subprocess.run(["xdotool", *map(str, words)], check=True)


def picture() -> Picture:
    """Return the screen, (H, W, 3)."""
    return np.asarray(ImageGrab.grab().convert("RGB"))


def wait(program: Program, is_reached: Callable[[], object]) -> None:
    """Wait until a condition holds while a program runs."""
    end = time.monotonic() + DEADLINE_S
    while not is_reached():
        assert program.poll() is None, f"the program ended with {program.returncode}"
        if time.monotonic() > end:
            write_png(FAILED, picture())
            raise AssertionError(f"this never came true; {FAILED} shows the screen")
        time.sleep(POLL_S)


def wait_for_title(program: Program, title: str) -> None:
    """Wait until a window of the program's class has this title."""
    wait(program, lambda: title in subprocess.run(SEARCH.split(), capture_output=True, text=True).stdout.splitlines())


def settled(program: Program) -> Picture:
    """Wait until the screen shows something and stays the same; return it."""
    last, since = picture(), time.monotonic()

    def stays() -> bool:
        nonlocal last, since
        now = picture()
        if not (now.any() and np.array_equal(now, last)):
            last, since = now, time.monotonic()
        return time.monotonic() - since > STILL_S

    wait(program, stays)
    return last


@contextmanager
def window(program: Program, title: str) -> Iterator[Program]:
    """Wait for the window of a program that was started; at the end, quit by the keyboard."""
    try:
        send("mousemove", *CORNER)
        wait_for_title(program, title)
        yield program
        send("key", "ctrl+q")
        assert program.wait(DEADLINE_S) == 0
    finally:
        program.kill()
        program.wait()
