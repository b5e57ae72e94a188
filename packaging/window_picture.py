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


def shows_photo(before: Image.Image, now: Image.Image) -> bool:
    """Return whether a photo is on the screen that was not there before."""
    pixels, former = np.asarray(now.convert("RGB")), np.asarray(before.convert("RGB"))
    return len(np.unique(pixels[(pixels != former).any(axis=-1)], axis=0)) >= MIN_NEW_COLORS


def main(picture: Path, *command: str) -> str:
    """Return what went wrong, "" if nothing did."""
    before = now = ImageGrab.grab()
    end = time.monotonic() + LIMIT_S
    with subprocess.Popen(command) as program:
        while program.poll() is None and not shows_photo(before, now) and time.monotonic() < end:
            time.sleep(1)
            now = ImageGrab.grab()
        code = program.poll()
        program.terminate()
    picture.parent.mkdir(parents=True, exist_ok=True)
    now.save(picture)
    if code is not None:
        return f"{command[0]} ended by itself with code {code}"
    return "" if shows_photo(before, now) else f"no photo on the screen after {LIMIT_S} s: see {picture}"


if __name__ == "__main__":
    sys.exit(main(Path(sys.argv[1]), *sys.argv[2:]) or 0)
