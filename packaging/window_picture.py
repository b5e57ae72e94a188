"""Start a program, save a picture of the screen, end it: python -P packaging/window_picture.py PICTURE COMMAND...

For hosted CI on Windows, macOS and Linux (X11). Fails unless a photo appears on the screen within LIMIT_S.
"""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
from PIL import Image, ImageGrab

LIMIT_S = 180
MIN_NEW_COLORS = 5000
"""Smallest number of colours among the changed pixels: a photo has more, an empty window and its panel have fewer."""


def screen() -> np.ndarray:
    """Return the screen's pixels [rows, columns, RGB]."""
    return np.asarray(ImageGrab.grab().convert("RGB"))


def shows_photo(before: np.ndarray, now: np.ndarray) -> bool:
    """Return whether a photo is on the screen that was not there before."""
    changed = now[(now != before).any(axis=-1)]
    return len(np.unique(changed, axis=0)) >= MIN_NEW_COLORS


def main(picture: str, *command: str) -> str:
    """Return what went wrong, "" if nothing did."""
    before, start = screen(), time.monotonic()
    with subprocess.Popen(command) as program:
        try:
            while program.poll() is None and not shows_photo(before, screen()) and time.monotonic() < start + LIMIT_S:
                time.sleep(1)
            Path(picture).parent.mkdir(parents=True, exist_ok=True)
            now = screen()
            Image.fromarray(now).save(picture)
            if program.poll() is not None:
                return f"{command[0]} ended by itself with code {program.returncode}"
            return "" if shows_photo(before, now) else f"no photo on the screen after {LIMIT_S} s: see {picture}"
        finally:
            program.terminate()


if __name__ == "__main__":
    sys.exit(main(*sys.argv[1:]) or 0)
