"""What depth edges and what lies behind them cost: shares of the processor time of making a field.

    IIBR_THREADS=1 python -m benchmarks.edge_cost [PHOTO ...] [--data DATA] [--scenes NAME,...] [--quality fast]

The demo photo comes along. Photos are made as the viewer makes them; scenes of DATA, as `iibr evaluate` takes
them, with 9 x 9 views at their own disparity, and with that blurred. Each part is timed where it is called, in the one
thread that does everything: no second field without it, and no other program, changes its share.
"""

from __future__ import annotations

import argparse
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmarks.speed.variants import BenchScene, bench_scenes
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.edges import refine as refining
from iibr_core.depth.search import open_with_depth
from iibr_core.evaluation.datasets import find_scenes
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.generation import stored_views
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_for_viewing, plan_literal
from iibr_core.inpainting import background
from iibr_core.rendering import view_synthesis
from iibr_core.runtime import tiling
from iibr_core.types import Disparity, GridShape, Photo, Quality
from viewer.cli.demo import demo_photo

PARTS: dict[str, tuple[tuple[ModuleType, str], ...]] = {
    "fit": ((refining, "fit_to_blur"),),
    "rims": ((refining, "settle_rims"),),
    "mixed": ((view_synthesis, "split_mixed_pixels"),),
    "lines": ((background, "find_lines"), (background, "mixed_beside")),
    "texture": ((background, "copy_exemplars"),),
    "frame": ((view_synthesis, "extend_beyond_frame"),),
    "specks": (
        (view_synthesis, "measure_detail"),
        (view_synthesis, "without_specks"),
        (stored_views, "without_specks"),
    ),
}
GRID = GridShape(9, 9)
REPEATS = 3
"""The first compiles; of the others the median."""


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("photos", type=Path, nargs="*", metavar="PHOTO")
    parser.add_argument("--data", type=Path)
    parser.add_argument("--scenes", default="", help="only those whose name contains one of these words, by commas")
    parser.add_argument("--quality", choices=("fast", "balanced"), help="the plan's where it is not said")
    options = parser.parse_args()
    if tiling.THREADS != 1:
        parser.error("parts are timed in one thread: set IIBR_THREADS=1")
    spent: Counter[str] = Counter()
    for part, places in PARTS.items():
        for module, name in places:
            setattr(module, name, timed(getattr(module, name), part, spent))
    print(f"{'':24} field, s {''.join(f'{part:>8}' for part in PARTS)}   all, % of the rest")
    for name, make in fields(options):
        if any(word in name for word in options.scenes.split(",")):
            print(f"{name:24} {shares(make, spent)}", flush=True)


def timed(function: Callable[..., Any], part: str, spent: Counter[str]) -> Callable[..., Any]:
    """The function, which adds its processor time to that of its part."""

    def measured(*values: Any, **named: Any) -> Any:
        start = time.thread_time()
        try:
            return function(*values, **named)
        finally:
            spent[part] += time.thread_time() - start

    return measured


def shares(make: Callable[[], None], spent: Counter[str]) -> str:
    """Seconds of the field, of it each part's per cent, and all of them over what remains."""
    rounds = []
    for _ in range(REPEATS):
        spent.clear()
        start = time.process_time()
        make()
        rounds.append((time.process_time() - start, dict(spent)))
    whole, parts = sorted(rounds[1:], key=lambda one: one[0])[(REPEATS - 1) // 2]
    each = "".join(f"{100 * parts.get(part, 0) / whole:8.1f}" for part in PARTS)
    added = sum(parts.values())
    return f"{whole:8.2f} {each}   {100 * added / (whole - added):.1f}"


def fields(options: argparse.Namespace) -> Iterator[tuple[str, Callable[[], None]]]:
    """Name, and what makes a field."""
    for path in (demo_photo(), *options.photos):
        yield path.stem, lambda path=path: make_of_photo(path, options.quality)
    for known in find_scenes(options.data) if options.data else ():
        if known.disparity:
            for scene in bench_scenes(known, DEFAULT_MAX_PIXELS):
                yield scene.name, lambda scene=scene: make_of_scene(scene, options.quality)


def make_of_photo(path: Path, quality: Quality | None) -> None:
    found = open_with_depth(path, DepthChoice(), DEFAULT_MAX_PIXELS)
    plan = plan_for_viewing(found.photo, found.disparity)
    for _ in generate(found.photo, plan.field_disparity(found.disparity), plan, quality=quality or plan.quality):
        pass


def make_of_scene(scene: BenchScene, quality: Quality | None) -> None:
    photo = Photo(scene.photo, float(scene.photo.shape[1]), scene.name)
    disparity = Disparity(refining.refine(scene.photo, scene.disparity), "its own")
    plan = plan_literal(photo, disparity, GRID)
    for _ in generate(photo, disparity, plan, quality=quality or plan.quality):
        pass


if __name__ == "__main__":
    main()
