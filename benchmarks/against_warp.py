"""Processor time of making fields, in turns with a plain warp of the same views, in one process.

    python -m benchmarks.against_warp [--data DATA] [--scenes NAME,...] [--repeats 3] [--warp FILE.py]

DATA holds scenes as `iibr evaluate` takes them, made with 9 x 9 views at their own disparity; the demo photo comes
along, with the parallax that the plan gives it. --warp: a file with `render(photo, disparity, s, t)` to compare with,
otherwise `iibr_core.evaluation.reference_warp`. Ratios are medians over rounds: other programs disturb them little.
"""

from __future__ import annotations

import argparse
import importlib
import sys
from collections.abc import Callable, Iterator
from itertools import islice
from pathlib import Path

from benchmarks.speed.measure import Cost, cost_of, in_turns, median_cost, median_ratio
from benchmarks.speed.variants import bench_scenes
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.edges.refine import refine
from iibr_core.depth.search import open_with_depth
from iibr_core.evaluation.datasets import find_scenes
from iibr_core.evaluation.reference_warp import reference_warp
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import ScenePlan, plan_for_viewing, plan_literal
from iibr_core.types import Disparity, FloatImage, GridShape, Photo, Quality, ViewOffset
from viewer.cli.demo import demo_photo

GRID = GridShape(9, 9)
Warp = Callable[[FloatImage, FloatImage, ViewOffset], object]


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path)
    parser.add_argument("--scenes", default="", help="only those whose name contains one of these words, by commas")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--qualities", default="fast,balanced")
    parser.add_argument("--warp", type=Path)
    options = parser.parse_args()
    warp = warp_of_file(options.warp) if options.warp else reference_warp
    for name, photo, disparity, plan in scenes(options.data):
        if any(word in name for word in options.scenes.split(",")):
            compare(name, photo, disparity, plan, options.qualities.split(","), warp, options.repeats)


def scenes(data: Path | None) -> Iterator[tuple[str, Photo, Disparity, ScenePlan]]:
    """Name, photo, the field's disparity, plan."""
    found = open_with_depth(demo_photo(), DepthChoice(), DEFAULT_MAX_PIXELS)
    plan = plan_for_viewing(found.photo, found.disparity)
    yield "demo photo", found.photo, plan.field_disparity(found.disparity), plan
    for known in find_scenes(data) if data else ():
        if known.disparity:
            (scene,) = bench_scenes(known, DEFAULT_MAX_PIXELS, with_soft=False)
            photo = Photo(scene.photo, float(scene.photo.shape[1]), scene.name)
            disparity = Disparity(refine(scene.photo, scene.disparity), "its own")
            yield scene.name, photo, disparity, plan_literal(photo, disparity, GRID)


def compare(
    name: str, photo: Photo, disparity: Disparity, plan: ScenePlan, qualities: list[Quality], warp: Warp, repeats: int
) -> None:
    """Print a line."""

    def make(quality: Quality) -> Iterator[object]:
        return generate(photo, disparity, plan, quality=quality)

    def make_all(quality: Quality) -> Callable[[], Cost]:
        return lambda: cost_of(lambda: [None for _ in make(quality)])

    grid = plan.grid
    offsets = [grid.offset(v, u) for v in range(grid.rows) for u in range(grid.columns)]
    for quality in qualities:  # compiles
        list(islice(make(quality), 12))
    warp(photo.pixels, disparity.values, offsets[0])
    ways = {"warp": lambda: cost_of(lambda: [warp(photo.pixels, disparity.values, at) and None for at in offsets])}
    costs = in_turns(ways | {quality: make_all(quality) for quality in qualities}, repeats, lambda *progress: None)
    chosen = {plan.quality: " (the plan's)"}
    words = [f"{q}{chosen.get(q, '')} {median_ratio(costs[q], costs['warp']):.2f}" for q in qualities]
    plain = median_cost(costs["warp"]).cpu_s
    print(f"{name:26} {grid.columns}x{grid.rows} {photo.size}  warp 1 = {plain:.2f} s  {'  '.join(words)}", flush=True)


def warp_of_file(path: Path) -> Warp:
    """The warp that a file's `render(photo, disparity, s, t)` does."""
    # By its name: what it keeps compiled looks for that.
    sys.path.insert(0, str(path.parent))
    module = importlib.import_module(path.stem)
    return lambda photo, disparity, at: module.render(photo, disparity, at.s, at.t)


if __name__ == "__main__":
    main()
