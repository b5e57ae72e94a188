"""What the plan predicts beside what is measured; constants fitted anew on some scenes and judged on others.

    python -m benchmarks.prediction [--data DATA] [--photos DIR] [--repeats 3] [--qualities fast,balanced,exact]

DATA holds scenes as `iibr evaluate` takes them: with made-up squares and some scenes that training draws they are what
constants are fitted to. Judged are other drawn scenes, the demo photo and the photos with depth of their own below DIR.
Run it on a machine that does nothing else, put what the last line says into `iibr_core/generation/cost_model.py`, and
run it again.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator
from pathlib import Path
from typing import get_args

import numpy as np

from benchmarks.speed.prediction import BenchInput, Prediction, fit_nanoseconds, is_near, predict, whole_field
from benchmarks.speed.scaling import made_up_scene
from benchmarks.speed.variants import bench_scenes
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.search import open_with_depth
from iibr_core.evaluation.datasets import find_scenes
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.generation.cost_model import CORES, NANOSECONDS
from iibr_core.generation.plan import plan_for_viewing
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import Disparity, GridShape, ImageSize, Photo, Quality, ViewOffset
from viewer.cli.demo import demo_photo

MADE_UP = ((1024, 2.0, 16, 9), (512, 2.0, 16, 9), (256, 2.0, 128, 5), (256, 8.0, 16, 13))
"""Side px, disparity range px, squares, views a side."""
DRAWN_TO_FIT = ((201, 360, 480, 16.0, 9), (202, 240, 320, 24.0, 5), (203, 480, 640, 8.0, 5), (204, 300, 300, 12.0, 13))
DRAWN = ((104, 240, 320, 8.0, 13), (102, 300, 400, 30.0, 9), (106, 400, 600, 6.0, 9), (105, 512, 512, 45.0, 7),
         (101, 480, 640, 12.0, 9), (103, 600, 800, 20.0, 5))  # fmt: skip
"""Seed, height, width, largest parallax px, views a side: these are judged, those above fitted to."""
PHOTO_EXTENSIONS = (".jpg", ".jpeg", ".heic")


def fitted_scenes(data: Path | None) -> Iterator[BenchInput]:
    """Made-up ones, drawn ones, and real ones with maps as they are and soft ones."""
    for side, range_px, squares, views in MADE_UP:
        name = f"{squares} squares, {side} px, {views}x{views}"
        yield BenchInput(name, *made_up_scene(side, range_px, squares), GridShape(views, views))
    for drawn in DRAWN_TO_FIT:
        yield drawn_scene(*drawn)
    for known in find_scenes(data) if data else ():
        if known.disparity:
            yield from map(whole_field, bench_scenes(known, DEFAULT_MAX_PIXELS))


def drawn_scene(seed: int, height: int, width: int, parallax_px: float, views: int) -> BenchInput:
    """A scene as training draws them."""
    size, reach = ImageSize(height, width), views // 2
    scene = random_scene(np.random.default_rng(seed), size, parallax_px / reach)
    pixels, values = render(scene, size, ViewOffset(0.0, 0.0))
    photo = Photo(pixels, float(width), f"drawn {seed}")
    return BenchInput(f"{photo.name}, {size}, {views}x{views}", photo, Disparity(values, ""), GridShape(views, views))


def judged_scenes(photos: Path | None) -> Iterator[BenchInput]:
    """Those that no constant is fitted to, the smallest first; photos with the field that their plan gives them."""
    for drawn in DRAWN:
        yield drawn_scene(*drawn)
    below = sorted(photos.rglob("*")) if photos else []
    for path in [demo_photo(), *(path for path in below if path.suffix.lower() in PHOTO_EXTENSIONS)]:
        found = open_with_depth(path, DepthChoice())
        if found.origin.kind in ("file", "embedded"):
            plan = plan_for_viewing(found.photo, found.disparity)
            name = f"{path.name}, {found.photo.size}, {plan.grid.columns}x{plan.grid.rows}"
            yield BenchInput(name, found.photo, plan.field_disparity(found.disparity), plan.grid)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--photos", type=Path)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--qualities", default=",".join(get_args(Quality)))
    parser.add_argument("--scenes", default="", help="only those whose name contains one of these words, by commas")
    options = parser.parse_args()
    qualities = [quality for quality in get_args(Quality) if quality in options.qualities.split(",")]
    words = options.scenes.split(",")

    def measure(title: str, given: Iterator[BenchInput]) -> list[Prediction]:
        print(f"== {title}", flush=True)
        found = []
        for scene in given:  # one at a time, so that something is seen
            if any(word in scene.name for word in words):
                for f in predict([scene], qualities, options.repeats, lambda done, total, doing: None):
                    found.append(f)
                    print(_line(f), flush=True)
        return found

    fitted = measure("fitted to", fitted_scenes(options.data))
    judged = measure("judged by", judged_scenes(options.photos))
    constants = fit_nanoseconds(fitted)
    for title, found in (("fitted to", fitted), ("judged by", judged)):
        _sum_up(f"{title}, constants now: time", [f.time_ratio for f in found])
        seconds = [sum(amount * each for amount, each in zip(f.work, constants)) * 1e-9 / CORES for f in found]
        _sum_up(f"{title}, constants fitted: time", [s / f.measured_s for s, f in zip(seconds, found)])
        _sum_up(f"{title}: memory", [f.memory_ratio for f in found])
    print("now:   ", *(f"{name}={value:.0f}" for name, value in zip(NANOSECONDS._fields, NANOSECONDS)))
    print("fitted:", *(f"{name}={value:.0f}" for name, value in zip(NANOSECONDS._fields, constants)))


def _line(f: Prediction) -> str:
    said = f"{f.predicted_s:6.2f} / {f.measured_s:6.2f} s = {f.time_ratio:.2f}"
    memory = f"{f.predicted_bytes / 2**20:5.0f} / {f.measured_bytes / 2**20:5.0f} MiB = {f.memory_ratio:.2f}"
    is_good = is_near(f.time_ratio) and is_near(f.memory_ratio) is not False
    return f"{f.scene:42} {f.quality:8}  {said}   {memory}{'' if is_good else '  <- off by more than a quarter'}"


def _sum_up(what: str, ratios: list[float]) -> None:
    if ratios:
        near = sum(is_near(ratio) is not False for ratio in ratios)
        print(f"{what}: {near} of {len(ratios)} within a quarter, from {min(ratios):.2f} to {max(ratios):.2f}")


if __name__ == "__main__":
    main()
