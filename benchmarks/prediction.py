"""What the plan predicts beside what is measured, on real and made-up scenes of several sizes; constants fitted anew.

    python -m benchmarks.prediction [--data DATA] [--repeats 3] [--qualities fast,balanced,exact]

DATA holds scenes as `iibr evaluate` takes them. Run it on a machine that does nothing else, put what the last line says
into `iibr_core/generation/cost_model.py`, and run it again.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import numpy as np

from benchmarks.speed.prediction import BenchInput, fit_nanoseconds, is_near, predict, whole_field
from benchmarks.speed.scaling import made_up_scene
from benchmarks.speed.variants import bench_scenes
from iibr_core.evaluation.datasets import find_scenes
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.generation.cost_model import NANOSECONDS
from iibr_core.types import GridShape, Quality

MADE_UP = ((1024, 2.0, 16, 9), (512, 2.0, 16, 9), (256, 2.0, 128, 5), (256, 8.0, 16, 13))
"""Side px, disparity range px, squares, views a side."""


def scenes(data: Path | None) -> Iterator[BenchInput]:
    """Real ones with maps as they are and soft ones, and made-up ones."""
    for side, range_px, squares, views in MADE_UP:
        name = f"{squares} squares, {side} px, {views}x{views}"
        yield BenchInput(name, *made_up_scene(side, range_px, squares), GridShape(views, views))
    for known in find_scenes(data) if data else ():
        if known.disparity:
            yield from map(whole_field, bench_scenes(known, DEFAULT_MAX_PIXELS))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--qualities", default=",".join(get_args(Quality)))
    parser.add_argument("--scenes", default="", help="only those whose name contains one of these words, by commas")
    options = parser.parse_args()
    qualities = [quality for quality in get_args(Quality) if quality in options.qualities.split(",")]
    given = [scene for scene in scenes(options.data) if any(word in scene.name for word in options.scenes.split(","))]
    words = {True: "", False: "  <- off by more than a quarter", None: ""}
    found = []
    for scene in given:  # one at a time, so that something is seen
        for f in predict([scene], qualities, options.repeats, lambda done, total, doing: None):
            found.append(f)
            said = f"{f.predicted_s:6.2f} / {f.measured_s:6.2f} s = {f.time_ratio:.2f}"
            memory = f"{f.predicted_bytes / 2**20:5.0f} / {f.measured_bytes / 2**20:5.0f} MiB = {f.memory_ratio:.2f}"
            is_good = is_near(f.time_ratio) and is_near(f.memory_ratio) is not False
            print(f"{f.scene:34} {f.quality:8}  {said}   {memory}{words[is_good]}", flush=True)
    for what, ratios in (("time", [f.time_ratio for f in found]), ("memory", [f.memory_ratio for f in found])):
        near = np.mean([is_near(ratio) is not False for ratio in ratios])
        print(f"{what}: {near:.0%} within a quarter, from {min(ratios):.2f} to {max(ratios):.2f}")
    print("now:   ", *(f"{name}={value:.0f}" for name, value in zip(NANOSECONDS._fields, NANOSECONDS)))
    print("fitted:", *(f"{name}={value:.0f}" for name, value in zip(NANOSECONDS._fields, fit_nanoseconds(found))))


if __name__ == "__main__":
    main()
