"""What is measured in processes of its own: the first picture, the window, scripts that judge from outside."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.speed.targets import SpeedTarget
from benchmarks.speed.variants import BenchScene
from iibr_core.formats.images.photo import write_image
from iibr_core.types import InputError

FIRST_PICTURE_S = 1.5
FIRST_PICTURES = 3
TIME_LIMIT_S = 3600.0
"""For a program outside; one that hangs must not take hours of figures with it."""

VIEW_JUDGE, PLAIN_REFOCUS = "judge_views.py", "plain_refocus.py"
JUDGED_SCENES = ("antinous", "teddy", "moebius", "motorcycle")
REFOCUSED_SCENE = "blender_shop_9x9"


def require_yardsticks(folder: Path | None, data: Path | None) -> None:
    """Raise InputError where the scripts, or the scenes that they judge by, are missing."""
    if folder is None:
        return
    if data is None:
        raise InputError(f"--yardsticks {folder}: needs scenes to judge by; give --data too")
    for name in (VIEW_JUDGE, PLAIN_REFOCUS):
        if not (folder / name).is_file():
            raise InputError(f"{folder / name}: no such file; --yardsticks names the folder of {name}")


def yardstick_lines(folder: Path, data: Path) -> tuple[str, ...]:
    """What the scripts say: PSNR of views that `iibr generate` writes, and time of a refocused picture."""
    iibr = Path(sys.executable).parent / "iibr"
    judge = [folder / VIEW_JUDGE, *JUDGED_SCENES, "--iibr", iibr, "--data", data]
    refocus = ["-m", "benchmarks.refocus", "--data", data / REFOCUSED_SCENE, "--yardstick", folder / PLAIN_REFOCUS]
    return (*output_lines(judge), *output_lines(refocus))


def first_picture_target(scene: BenchScene) -> SpeedTarget:
    """From the start of a process to the first picture of the scene, drawn without a display."""
    seconds = []
    with tempfile.TemporaryDirectory() as folder:
        photo = Path(folder) / "photo.png"
        write_image(photo, scene.photo)
        np.save(Path(folder) / "photo_disparity.npy", scene.disparity)
        words = ["screenshot", str(photo), "--grid", "1", "-o", str(Path(folder) / "picture.png")]
        for _ in range(FIRST_PICTURES):
            start = time.perf_counter()
            subprocess.run([sys.executable, "-P", "-m", "viewer", *words], check=True, capture_output=True)
            seconds.append(time.perf_counter() - start)
    said = f"{min(seconds):.2f} s, the least of {len(seconds)}"
    what = "photo and disparity: process start to first picture"
    return SpeedTarget(what, f"<= {FIRST_PICTURE_S:g} s", said, min(seconds) <= FIRST_PICTURE_S)


def window_lines() -> tuple[str, ...]:
    """What the real window takes, see benchmarks.window; one line why, where it cannot be opened."""
    return output_lines(["-m", "benchmarks.window"])


def output_lines(arguments: list[object]) -> tuple[str, ...]:
    """The lines that Python prints when it is run with these arguments; its last word where it fails."""
    command = [sys.executable, *map(str, arguments)]
    try:
        run = subprocess.run(command, capture_output=True, text=True, check=False, timeout=TIME_LIMIT_S)
    except subprocess.TimeoutExpired:
        return (f"failed: {' '.join(map(str, arguments))} did not end within {TIME_LIMIT_S:g} s",)
    lines = run.stdout.splitlines()
    if run.returncode:
        lines.append(f"failed: {(run.stderr.strip().splitlines() or ['no reason given'])[-1]}")
    return tuple(lines)
