"""Photos at their own size: from opening to the first picture, and pictures saved at that size, each in a process.

python -m benchmarks.full_size [12 24 48] [--save 12]

Prints lines of a Markdown table: seconds on the clock and of the processor, peak memory, and for saved pictures how
near they come, made smaller, to the usual picture. Photos are made up, with a map a quarter as wide.
"""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import numpy as np

from benchmarks.memory import SIZES, write_photo
from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.evaluation.metrics import psnr
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.maps.writer import write_map
from iibr_core.rendering.lens_light import mean_of_areas
from iibr_core.types import image_size

LENSES = {
    "pinhole, in the middle": ("--view", "0,0"),
    "pinhole, aside": ("--view", "1.3,-0.7"),
    "aperture of 81 views' width": ("--aperture", "9"),
}


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("megapixels", nargs="*", type=int, default=[12, 24, 48])
    parser.add_argument("--save", type=int, default=12, choices=list(SIZES), help="megapixels of what is saved")
    parser.add_argument("--opened", type=Path, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.opened is not None:
        print(json.dumps(first_picture(args.opened)))
        return
    print("| what | clock, s | processor, s | peak, MiB | PSNR, dB |\n| --- | --- | --- | --- | --- |", flush=True)
    with tempfile.TemporaryDirectory() as folder:
        for size in args.megapixels:
            photo = photo_with_map(Path(folder), size)
            seen = measured([sys.executable, "-P", "-m", "benchmarks.full_size", "--opened", str(photo)])
            print(row(f"{size} MP: from the start of a process to the first picture", *seen), flush=True)
        photo = photo_with_map(Path(folder), args.save)
        for name, options in LENSES.items():
            full, usual = photo.with_name("full.png"), photo.with_name("usual.png")
            seen = measured([*screenshot(photo, full), "--full", *options])
            measured([*screenshot(photo, usual), *options])
            print(row(f"{args.save} MP saved: {name}", *seen, likeness(full, usual)), flush=True)


def photo_with_map(folder: Path, megapixels: int) -> Path:
    """A JPEG of so many, with a depth edge, and its small map beside it."""
    photo = folder / f"{megapixels}.jpg"
    if not photo.exists():
        height, width = SIZES[megapixels]
        write_photo(photo, (height, width))
        disparity = np.linspace(-1, 0, height // 4, dtype=np.float32)[:, None] * np.ones(width // 4, np.float32)
        disparity[:, width // 12 : width // 8] = 2.0
        write_map(folder / f"{megapixels}_disparity.pfm", disparity)
    return photo


def screenshot(photo: Path, output: Path) -> list[str]:
    return [sys.executable, "-P", "-m", "viewer", "screenshot", str(photo), "-o", str(output), "--force"]


def measured(command: list[str]) -> tuple[float, float, float]:
    """Seconds on the clock and of the processor, and peak in MiB, of a process."""
    start = time.perf_counter()
    child = subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    _, status, used = os.wait4(child.pid, 0)
    child.returncode = os.waitstatus_to_exitcode(status)
    if child.returncode:
        sys.exit(f"{' '.join(command)}: ended with {child.returncode}")
    return time.perf_counter() - start, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def first_picture(photo: Path) -> tuple[int, int]:
    """Open a photo as the window does, up to its first picture."""
    from viewer.app.headless import HeadlessViewer
    from viewer.model.state.scene import Source

    with HeadlessViewer() as viewer:
        viewer.open_scene(Source(str(photo)), 1.0, lambda progress: None)
        height, width = image_size(viewer.picture())
    return height, width


def likeness(full: Path, usual: Path) -> float:
    """PSNR of the full picture, made smaller, against the usual one."""
    expected = read_photo(usual).pixels
    light = linear_from_srgb(read_photo(full, 10**9).pixels)
    return psnr(srgb_from_linear(mean_of_areas(light, image_size(expected))), expected)


def row(what: str, clock_s: float, processor_s: float, peak: float, decibels: float | None = None) -> str:
    """A line of the table."""
    likeness = "" if decibels is None else f"{decibels:.1f}"
    return f"| {what} | {clock_s:.1f} | {processor_s:.1f} | {peak:.0f} | {likeness} |"


if __name__ == "__main__":
    main()
