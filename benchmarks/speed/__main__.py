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
from iibr_core.generation.cost_model import CORES

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
from benchmarks.harness.reports import parser_of, start
from benchmarks.harness.timing import (
    cost_of,
    field_costs,
    in_turns,
    median_cost,
    median_ratio,
)
from benchmarks.speed.speed_report import Bench, Figures, Measured, SpeedTarget, write_bench
from benchmarks.speed.variants import REFERENCE, VARIANTS, Variant, evaluated_views, field_cost
from iibr_core.evaluation.metrics import bounded_psnr, flip
from iibr_core.method.light_field import generate
from iibr_core.method.plan import plan_for_viewing, plan_literal
from iibr_core.types import (
    ImageSize,
    InputError,
    Quality,
    image_size,
)
from viewer.cli.terminal import show_progress

DRAWN_SIZE, DRAWN_PX = ImageSize(256, 256), 2.0
USUAL_SIZE = ImageSize(512, 512)
MEGAPIXEL_SIDE, SQUARES = 1024, 16
FIELD_S, MEGAPIXEL_S, FLAT_CHEAPER = 1.5, 5.0, 20
BEHIND_FRONT_DB = 0.1
AS_GOOD_DB, MOST_SLOWER = 0.05, 1.25
"""A variant this little worse is as good; the plan's choice may take so many times as long."""
TIMED: tuple[Quality, ...] = ("fast", "balanced")


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
        own = drawn_scene(0, DRAWN_SIZE, DRAWN_PX, FIELD, judged_of(FIELD))
        scenes = [own] if options.quick else [own, soften(own)]
    with show_progress("measuring") as show:
        bench = measure(scenes, options.repeats, options.quick, show)
    for path in write_bench(options.out, bench):
        print(path)


def measure(scenes: Sequence[BenchScene], repeats: int, quick: bool, show: ReportProgress) -> Bench:
    """Every variant on each scene; targets on its own maps."""
    figures = tuple(measure_scene(scene, VARIANTS, repeats, show) for scene in scenes)
    usual = [one for one in scenes if not one.is_soft and image_size(one.photo) == USUAL_SIZE and one.grid == FIELD]
    targets = [] if quick else [target for one in usual[:1] for target in field_targets(one, repeats, show)]
    targets += front_targets([one for one in figures if not one.is_soft])
    return Bench(figures, tuple(targets), f"{platform.machine()}, {platform.system()}.")


def measure_scene(scene: BenchScene, variants: Sequence[Variant], repeats: int, show: ReportProgress) -> Figures:
    """Every variant on one scene, timed in turns."""
    errors = {}
    for k, variant in enumerate(variants):
        show(k, len(variants), f"{scene.name}: error of {variant.name}")
        made = evaluated_views(variant, scene)
        each = [(bounded_psnr(image, scene.truth[at]), flip(image, scene.truth[at])) for at, image in made.items()]
        errors[variant.name] = [float(mean) for mean in np.mean(each, axis=0)]
    ways = {variant.name: partial(field_cost, variant, scene) for variant in variants}
    costs = in_turns(ways, repeats, lambda done, total, name: show(done, total, f"{scene.name}: {name}"))
    measured = tuple(
        Measured(name, median_cost(own), median_ratio(own, costs[REFERENCE.name]), *errors[name])
        for name, own in costs.items()
    )
    height, width = image_size(scene.photo)
    planned: str = plan_literal(*scene.given, scene.grid).quality  # variants of one quality alone are called so
    found = Figures(scene.name, "", measured, planned, scene.is_soft)
    about = (
        f"{len(scene.field)} views of {width}x{height}, {len(scene.truth)} judged. The plan would choose *{planned}*,"
        f" {found.behind_front_db:.2f} dB behind the best that takes no longer."
    )
    return replace(found, about=about)


def field_targets(scene: BenchScene, repeats: int, show: ReportProgress) -> Iterator[SpeedTarget]:
    """Of a real field of 9x9 views of 512x512, of one of 1 MP, and of a flat photo."""
    large = squares_scene(MEGAPIXEL_SIDE, 2.0, SQUARES)
    named = {f"9x9 of {USUAL_SIZE}, {scene.name}": scene, large.name: large}
    fields = {f"{name}, {quality}, warm": (one, quality) for name, one in named.items() for quality in TIMED}
    costs = field_costs(fields, repeats, show)
    for what, cost in costs.items():
        alone, most_s = cost.cpu_s / CORES, FIELD_S if fields[what][0] is scene else MEGAPIXEL_S
        said = f"{alone:.2f} s of processor time over {CORES} cores ({cost.wall_s:.2f} s by the clock)"
        yield SpeedTarget(what, f"<= {most_s:g} s", said, alone <= most_s)
    photo, flat = replace(scene, disparity=np.zeros_like(scene.disparity)).given
    plan = plan_for_viewing(photo, flat)
    flat_s = median_cost([cost_of(lambda: list(generate(photo, flat, plan))) for _ in range(5 * repeats)]).cpu_s
    cheaper = next(iter(costs.values())).cpu_s / max(flat_s, 1e-6)
    target = f">= {FLAT_CHEAPER} times cheaper"
    yield SpeedTarget(f"a flat photo against {scene.name}", target, f"{cheaper:.0f} times", cheaper >= FLAT_CHEAPER)


def front_targets(scenes: Sequence[Figures]) -> Iterator[SpeedTarget]:
    """On each scene, how far the plan's choice is behind the best variant that takes no longer, and how much slower it
    is than the fastest that is as good.
    """
    for scene in scenes:
        behind, as_good = scene.behind_front_db, scene.fastest_as_good(AS_GOOD_DB)
        slower = scene.choice.ratio / as_good.ratio
        what = f"the plan's default against the front at equal time, {scene.what}"
        said = f"{behind:.2f} dB (*{scene.planned}*)"
        yield SpeedTarget(what, f"<= {BEHIND_FRONT_DB:g} dB behind", said, behind <= BEHIND_FRONT_DB)
        what = f"the plan's default against the fastest within {AS_GOOD_DB:g} dB, {scene.what}"
        said = f"{slower:.2f} times its time (*{as_good.name}*)"
        yield SpeedTarget(what, f"<= {MOST_SLOWER:g} times", said, slower <= MOST_SLOWER)


if __name__ == "__main__":
    start("benchmarks.speed", main)
