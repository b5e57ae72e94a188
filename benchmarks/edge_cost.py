"""What depth edges and what lies behind them cost: shares of the processor time of making a field.

    IIBR_THREADS=1 python -m benchmarks.edge_cost [PHOTO ...] [--data DATA] [--only NAME,...] [--quality fast]

The demo photo comes along. Photos are made as the viewer makes them; scenes of DATA, as `iibr evaluate` takes
them, with 9 x 9 views at their own disparity, and with that blurred. Each part is timed where it is called, in the one
thread that does everything: no second field without it, and no other program, changes its share.
"""

from __future__ import annotations

import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from itertools import chain
from pathlib import Path
from types import ModuleType
from typing import Any

from benchmarks.harness.report import emit, head, is_wanted, parser_of, row, start
from benchmarks.harness.scenes import DEMO, FIELD, BenchScene, data_scenes
from benchmarks.harness.timing import cost_of
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.edges import refine as refining
from iibr_core.depth.search import open_with_depth
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS
from iibr_core.generation import stored_views
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_for_viewing, plan_literal
from iibr_core.inpainting import background
from iibr_core.rendering import view_synthesis
from iibr_core.runtime import tiling
from iibr_core.types import Quality

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
REPEATS = 3
"""The first compiles; of the others the median."""


def main() -> None:
    parser = parser_of(__doc__, "data", "only")
    parser.add_argument("photos", type=Path, nargs="*", metavar="PHOTO")
    parser.add_argument("--quality", choices=("fast", "balanced"), help="the plan's where it is not said")
    options = parser.parse_args()
    if tiling.THREADS != 1:
        parser.error("parts are timed in one thread: set IIBR_THREADS=1")
    spent: Counter[str] = Counter()
    for part, places in PARTS.items():
        for module, name in places:
            setattr(module, name, timed(getattr(module, name), part, spent))
    fields = chain(
        ((path.stem, partial(make_of_photo, path)) for path in (DEMO, *options.photos)),
        ((scene.name, partial(make_of_scene, scene)) for scene in data_scenes(options.data)),
    )
    rows = (
        row(name, *shares(partial(make, options.quality), spent))
        for name, make in fields
        if is_wanted(name, options.only)
    )
    emit(chain([head("% of a field's time", "field, s", *PARTS, "all, % of the rest")], rows))


def timed(function: Callable[..., Any], part: str, spent: Counter[str]) -> Callable[..., Any]:
    """The function, which adds its processor time to that of its part."""

    def measured(*values: Any, **named: Any) -> Any:
        start = time.thread_time()
        try:
            return function(*values, **named)
        finally:
            spent[part] += time.thread_time() - start

    return measured


def shares(make: Callable[[], object], spent: Counter[str]) -> list[str]:
    """Seconds of the field, of it each part's per cent, and all of them over what remains."""
    rounds = []
    for _ in range(REPEATS):
        spent.clear()
        rounds.append((cost_of(make).cpu_s, dict(spent)))
    whole, parts = sorted(rounds[1:], key=lambda one: one[0])[(REPEATS - 1) // 2]
    each = [100 * parts.get(part, 0) / whole for part in PARTS]
    added = sum(parts.values())
    return [f"{whole:.2f}", *(f"{share:.1f}" for share in (*each, 100 * added / (whole - added)))]


def make_of_photo(path: Path, quality: Quality | None) -> None:
    found = open_with_depth(path, DepthChoice(), DEFAULT_MAX_PIXELS)
    plan = plan_for_viewing(found.photo, found.disparity)
    list(generate(found.photo, plan.field_disparity(found.disparity), plan, quality=quality or plan.quality))


def make_of_scene(scene: BenchScene, quality: Quality | None) -> None:
    photo, disparity = replace(scene, disparity=refining.refine(scene.photo, scene.disparity)).given
    plan = plan_literal(photo, disparity, FIELD)
    list(generate(photo, disparity, plan, quality=quality or plan.quality))


if __name__ == "__main__":
    start("benchmarks.edge_cost", main)
