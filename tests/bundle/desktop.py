"""A screen on which programs of another system, or of the checkout, show their windows."""

from __future__ import annotations

import os
import subprocess
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import ImageGrab

from tests.image_compare import write_png

DEADLINE_S = 120.0
STILL_S = 3.0
"""Time after which a picture that stays the same is taken for the last, in seconds."""
POLL_S = 0.05
FAILED = Path(__file__).parents[2] / "out" / "chroots" / "failed.png"
"""Picture of the screen where a condition did not come true."""
Picture = NDArray[np.uint8]


@dataclass(frozen=True)
class Desktop:
    """A private X server without a window manager."""

    display: str

    def send(self, *words: object) -> None:
        """Move the pointer and press keys by xdotool."""
        subprocess.run(["xdotool", *map(str, words)], check=True, env={**os.environ, "DISPLAY": self.display})

    def picture(self) -> Picture:
        """Return the screen, (H, W, 3)."""
        return np.asarray(ImageGrab.grab(xdisplay=self.display).convert("RGB"))

    def wait(self, program: subprocess.Popen[bytes], is_reached: Callable[[], object]) -> None:
        """Wait until a condition holds while a program runs."""
        end = time.monotonic() + DEADLINE_S
        while not is_reached():
            assert program.poll() is None, f"the program ended with {program.returncode}"
            if time.monotonic() > end:
                write_png(FAILED, self.picture())
                raise AssertionError(f"this never came true; {FAILED} shows the screen")
            time.sleep(POLL_S)

    def wait_for_title(self, program: subprocess.Popen[bytes], title: str) -> None:
        """Wait until a window of the program's class has this title."""
        words = ["xdotool", "search", "--onlyvisible", "--class", "^iibr$", "getwindowname", "%@"]
        environment = {**os.environ, "DISPLAY": self.display}

        def titles() -> list[str]:
            return subprocess.run(words, env=environment, capture_output=True, text=True).stdout.splitlines()

        self.wait(program, lambda: title in titles())

    def settled(self, program: subprocess.Popen[bytes]) -> Picture:
        """Wait until the screen shows something and stays the same; return it."""
        last, since = self.picture(), time.monotonic()

        def stays() -> bool:
            nonlocal last, since
            now = self.picture()
            if not (now.any() and np.array_equal(now, last)):
                last, since = now, time.monotonic()
            return time.monotonic() - since > STILL_S

        self.wait(program, stays)
        return last

    @contextmanager
    def window(self, program: subprocess.Popen[bytes], title: str) -> Iterator[subprocess.Popen[bytes]]:
        """Wait for the window of a program that was started; at the end, quit by the keyboard."""
        try:
            self.wait_for_title(program, title)
            yield program
            self.send("key", "ctrl+q")
            assert program.wait(DEADLINE_S) == 0
        finally:
            program.kill()
            program.wait()
