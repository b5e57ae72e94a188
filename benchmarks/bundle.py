"""Compare the bundle with the checkout: time to the window and to its first picture, on a private X server.

    python -m benchmarks bundle [--rounds 7]

Both open the demo photo, in turns; times count from the start of the program, ratios are medians over the rounds. Also
printed: sizes of the .deb and of the bundle. `make deb` writes both.
"""

from __future__ import annotations

import argparse
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
BUNDLE, PACKAGES = ROOT / "out" / "bundle" / "iibr", "dist/iibr_*.deb"
PROGRAMS = {"bundle": [str(BUNDLE / "iibr")], "checkout": [sys.executable, "-P", "-m", "viewer"]}
MIN_COLORS = 1000
"""Number of colours on the screen from which on it shows a photo; an empty window has fewer."""
POLL_S = 0.01
DEADLINE_S = 60


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=7)
    rounds = parser.parse_args().rounds
    packages = sorted(ROOT.glob(PACKAGES))
    if not packages or not BUNDLE.exists():
        raise InputError("there is no bundle: run `make deb` first")
    times: dict[str, list[tuple[float, float]]] = {name: [] for name in PROGRAMS}
    with private_display(), tempfile.TemporaryDirectory() as home:
        for _ in range(rounds + 1):
            for name, command in PROGRAMS.items():
                times[name].append(time_of([*command, "demo"], home))
    used = subprocess.run(["du", "-sm", str(BUNDLE)], capture_output=True, text=True, check=True).stdout.split()[0]
    rows = [("size of the .deb", f"{packages[-1].stat().st_size / 1e6:.0f} MB"), ("size of the bundle", f"{used} MB")]
    bundle, checkout = (np.array(times[name][1:]) for name in ("bundle", "checkout"))  # the first round fills caches
    for k, what in enumerate(("window", "first picture")):
        ratio = np.median(bundle[:, k] / checkout[:, k])
        medians = f"{np.median(bundle[:, k]):.2f} s, checkout {np.median(checkout[:, k]):.2f} s"
        rows.append((what, f"{medians}: {ratio:.2f} times"))
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
