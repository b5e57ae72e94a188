"""Compare the bundle with the checkout: time to the window and to its first picture, on a private X server.

    python -m benchmarks bundle

Both open the demo photo, in turns; times count from the start of the program, ratios are medians over the rounds.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from PIL import ImageGrab

from benchmarks.report import markdown
from iibr_core.types import InputError
from tests.xvfb import private_display

ROOT = Path(__file__).parents[1]
BUNDLE = ROOT / "out" / "bundle" / "iibr" / "iibr"
PROGRAMS = [str(BUNDLE)], [sys.executable, "-P", "-m", "viewer"]
MIN_COLORS = 1000
"""Number of colours on the screen from which on it shows a photo; an empty window has fewer."""
POLL_S = 0.01
ROUNDS = 7
DEADLINE_S = 60


def main() -> None:
    """Print the table."""
    if not BUNDLE.exists():
        raise InputError("there is no bundle: run `make bundle` first")
    with private_display(), tempfile.TemporaryDirectory() as home:
        # (round, program, moment); the first round fills caches
        times_s = np.array([[time_of([*command, "demo"], home) for command in PROGRAMS] for _ in range(ROUNDS + 1)][1:])
    (bundle, checkout), ratios = np.median(times_s, axis=0), np.median(times_s[:, 0] / times_s[:, 1], axis=0)
    rows = [
        (moment, f"{bundle[k]:.2f} s, checkout {checkout[k]:.2f} s: {ratios[k]:.2f} times")
        for k, moment in enumerate(("window", "first picture"))
    ]
    print(markdown(("what", "measured"), rows))


def time_of(command: Sequence[str], home: str) -> tuple[float, float]:
    """Return the seconds from a start until the screen changes, and until it shows a photo."""
    environment = {**os.environ, "HOME": home, "XDG_RUNTIME_DIR": home, "PYTHONPATH": str(ROOT)}
    began, window_s = time.perf_counter(), 0.0
    with subprocess.Popen(command, env=environment, stderr=subprocess.DEVNULL) as program:
        try:
            while time.perf_counter() - began < DEADLINE_S:
                colors = ImageGrab.grab().getcolors(MIN_COLORS)
                seconds = time.perf_counter() - began
                if colors is None:
                    return window_s or seconds, seconds
                if len(colors) > 1 and not window_s:
                    window_s = seconds
                time.sleep(POLL_S)
        finally:
            program.kill()
    raise InputError(f"{command[0]}: showed no picture in {DEADLINE_S} seconds")


if __name__ == "__main__":
    main()
