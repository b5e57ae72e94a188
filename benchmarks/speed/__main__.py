"""Measures speed against error for every switch, and writes tables and a plot: speed.md, speed.svg.

    python -m benchmarks.speed --out out/bench [--data DATA] [--repeats 3] [--quick]          # make bench

Without DATA a drawn scene with known views is measured. --quick: no soft maps, no large fields: to see that it works.
Machines differ and are shared: quote medians and ratios.
"""

from __future__ import annotations

import platform
from collections.abc import Iterator, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from benchmarks.harness.bench_scenes import (
    FIELD,
    BenchScene,
    data_scenes,
    drawn_scene,
    judged_of,
    require_scenes,
    soften,
    squares_scene,
)
from benchmarks.harness.reports import CORES, parser_of, start
from benchmarks.harness.timing import cost_of, field_costs, in_turns, median_cost, median_ratio
from benchmarks.speed.speed_report import Bench, Figures, Measured, SpeedTarget, write_bench
from benchmarks.speed.variants import REFERENCE, VARIANTS, Variant, evaluated_views, field_cost
from iibr_core.evaluation.metrics import bounded_psnr, flip
from iibr_core.method.light_field import generate
from iibr_core.method.plan import plan_for_viewing
from iibr_core.runtime.work import report_progress
from iibr_core.types import ImageSize, InputError, image_size
from viewer.cli.terminal import show_progress

DRAWN_SIZE, DRAWN_PX = ImageSize(256, 256), 2.0
USUAL_SIZE = ImageSize(512, 512)
MEGAPIXEL_SIDE, SQUARES = 1024, 16
FIELD_S, MEGAPIXEL_S, FLAT_CHEAPER = 1.5, 5.0, 20


def main() -> None:
    parser = parser_of(
        __doc__, "data", "repeats", out={"required": True, "metavar": "DIR", "help": "folder to write to"}
    )
    parser.add_argument("--quick", action="store_true")
    options = parser.parse_args()
    if not options.out.is_dir():
        raise InputError(f"{options.out}: is no folder; --out names one that exists")
    if options.data:
        scenes = require_scenes(options.data, list(data_scenes(options.data, with_soft=not options.quick)))
    else:
        drawn = drawn_scene(0, DRAWN_SIZE, DRAWN_PX, FIELD, judged_of(FIELD))
        scenes = [drawn] if options.quick else [drawn, soften(drawn)]
    with show_progress("measuring"):
        bench = measure(scenes, options.repeats, options.quick)
    for path in write_bench(options.out, bench):
        print(path)


def measure(scenes: Sequence[BenchScene], repeats: int, quick: bool) -> Bench:
    """Return every variant on each scene, and targets on maps as they are."""
    figures = tuple(measure_scene(scene, VARIANTS, repeats) for scene in scenes)
    usual = [one for one in scenes if not one.is_soft and image_size(one.photo) == USUAL_SIZE and one.grid == FIELD]
    targets = [] if quick else [target for one in usual[:1] for target in field_targets(one, repeats)]
    return Bench(figures, tuple(targets), f"{platform.machine()}, {platform.system()}.")


def measure_scene(scene: BenchScene, variants: Sequence[Variant], repeats: int) -> Figures:
    """Return every variant on one scene, timed in turns."""
    errors = {}
    for k, variant in enumerate(variants):
        report_progress(k, len(variants), f"{scene.name}: error of {variant.name}")
        made = evaluated_views(variant, scene)
        each = [(bounded_psnr(image, scene.truth[at]), flip(image, scene.truth[at])) for at, image in made.items()]
        errors[variant.name] = [float(mean) for mean in np.mean(each, axis=0)]
    costs = in_turns({variant.name: partial(field_cost, variant, scene) for variant in variants}, repeats)
    measured = tuple(
        Measured(name, median_cost(found), median_ratio(found, costs[REFERENCE.name]), *errors[name])
        for name, found in costs.items()
    )
    about = f"{len(scene.field)} views of {image_size(scene.photo)}, {len(scene.truth)} judged."
    return Figures(scene.name, about, measured, scene.is_soft)


def field_targets(scene: BenchScene, repeats: int) -> Iterator[SpeedTarget]:
    """Yield the times of a real field of 9x9 views of 512x512, of one of 1 MP, and of a flat photo."""
    large = squares_scene(MEGAPIXEL_SIDE, 2.0, SQUARES)
    fields = {f"9x9 of {USUAL_SIZE}, {scene.name}, warm": scene, f"{large.name}, warm": large}
    costs = field_costs(fields, repeats)
    for (what, cost), most_s in zip(costs.items(), (FIELD_S, MEGAPIXEL_S)):
        shared_s = cost.cpu_s / CORES
        measured = f"{shared_s:.2f} s of processor time over {CORES} cores ({cost.wall_s:.2f} s by the clock)"
        yield SpeedTarget(what, f"<= {most_s:g} s", measured, shared_s <= most_s)
    photo, flat = replace(scene, disparity=np.zeros_like(scene.disparity)).given
    plan = plan_for_viewing(photo, flat)
    flat_s = median_cost([cost_of(lambda: list(generate(photo, flat, plan))) for _ in range(5 * repeats)]).cpu_s
    cheaper = next(iter(costs.values())).cpu_s / max(flat_s, 1e-6)
    target = f">= {FLAT_CHEAPER} times cheaper"
    yield SpeedTarget(f"a flat photo against {scene.name}", target, f"{cheaper:.0f} times", cheaper >= FLAT_CHEAPER)


if __name__ == "__main__":
    start("benchmarks.speed", main)
