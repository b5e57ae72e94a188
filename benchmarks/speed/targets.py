"""The figures the project set itself, judged on what the bench measures."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.speed.figures import SceneFigures
from benchmarks.speed.measure import Cost, cost_of, in_turns, median_cost, peak_bytes
from benchmarks.speed.prediction import WITHIN, BenchInput, Prediction, is_near, make_field, whole_field
from benchmarks.speed.scaling import made_up_scene
from benchmarks.speed.variants import BenchScene
from iibr_core.generation.cost_model import CORES
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_for_viewing, plan_literal
from iibr_core.types import Disparity, GridShape, Quality, ReportProgress

MEGAPIXEL_SIDE = 1024
SQUARES = 16
FIELD_S, MEGAPIXEL_S = 1.5, 5.0
MOST_MEMORY = 2.5
FLAT_CHEAPER = 20
BEHIND_FRONT_DB = 0.1
AS_GOOD_DB, MOST_SLOWER = 0.05, 1.25
"""A variant this little worse is as good; the plan's choice may take so many times as long."""
TIMED: tuple[Quality, ...] = ("fast", "balanced")


@dataclass(frozen=True)
class SpeedTarget:
    """One figure with its target, in words. is_met: None where this system cannot tell."""

    what: str
    target: str
    measured: str
    is_met: bool | None


def field_targets(scene: BenchScene, repeats: int, report_progress: ReportProgress) -> Iterator[SpeedTarget]:
    """Of a real field, which should be 9x9 of 512x512, of a made-up one of 1 MP, and of a flat photo."""
    real = whole_field(scene)
    large = BenchInput("9x9 of 1 MP", *made_up_scene(MEGAPIXEL_SIDE, 2.0, SQUARES), GridShape(9, 9))
    ways = {
        (given.name, quality): (lambda given=given, quality=quality: cost_of(lambda: make_field(given, quality)))
        for given in (real, large)
        for quality in TIMED
    }
    in_words = {f"{name}, {quality}": way for (name, quality), way in ways.items()}
    costs = dict(zip(ways, map(median_cost, in_turns(in_words, repeats, report_progress).values())))
    size = f"{real.grid.columns}x{real.grid.rows} of {scene.photo.shape[1]}x{scene.photo.shape[0]}"
    for given, words, most_s in ((real, f"{size}, {real.name}", FIELD_S), (large, large.name, MEGAPIXEL_S)):
        for quality in TIMED:
            yield _time_target(f"{words}, {quality}, warm", costs[given.name, quality], most_s)
    yield _memory_target(large)
    yield _flat_target(real, costs[real.name, "fast"].cpu_s, 5 * repeats)


def front_targets(scenes: Sequence[SceneFigures]) -> Iterator[SpeedTarget]:
    """On each scene, how far the plan's choice is behind the best variant that takes no longer, and how much slower it
    is than the fastest that is as good.
    """
    for scene in scenes:
        behind = scene.behind_front_db
        what = f"the plan's default against the front at equal time, {scene.name}"
        measured = f"{behind:.2f} dB (*{scene.planned}*)"
        yield SpeedTarget(what, f"<= {BEHIND_FRONT_DB:g} dB behind", measured, behind <= BEHIND_FRONT_DB)
        as_good = scene.fastest_as_good(AS_GOOD_DB)
        slower = scene.choice.ratio / as_good.ratio
        what = f"the plan's default against the fastest within {AS_GOOD_DB:g} dB, {scene.name}"
        measured = f"{slower:.2f} times its time (*{as_good.variant.name}*)"
        yield SpeedTarget(what, f"<= {MOST_SLOWER:g} times", measured, slower <= MOST_SLOWER)


def prediction_targets(predicted: Sequence[Prediction]) -> Iterator[SpeedTarget]:
    """How many of the plan's predictions are as near as they should be."""
    ratios = {"time": [f.time_ratio for f in predicted], "peak memory": [f.memory_ratio for f in predicted]}
    for what, found in ratios.items():
        known = [ratio for ratio in found if math.isfinite(ratio)]
        if known:
            near = sum(map(bool, map(is_near, known)))
            said = f"{near} of {len(known)}; predicted / measured {min(known):.2f} to {max(known):.2f}"
            yield SpeedTarget(f"the plan's {what}", f"within {WITHIN:.0%}", said, near == len(known))


def _time_target(what: str, cost: Cost, most_s: float) -> SpeedTarget:
    """Judged by processor time over all cores: what the wall clock shows on a machine that does nothing else."""
    alone = cost.cpu_s / CORES
    said = f"{alone:.2f} s of processor time over {CORES} cores ({cost.wall_s:.2f} s by the clock)"
    return SpeedTarget(what, f"<= {most_s:g} s", said, alone <= most_s)


def _memory_target(given: BenchInput) -> SpeedTarget:
    field_bytes = plan_literal(given.photo, given.disparity, given.grid).field_bytes
    ratio = peak_bytes(make_field, given, "balanced") / field_bytes
    is_met = ratio <= MOST_MEMORY if math.isfinite(ratio) else None
    return SpeedTarget(
        f"{given.name}, peak memory over the light field's", f"<= {MOST_MEMORY:g}", f"{ratio:.2f}", is_met
    )


def _flat_target(real: BenchInput, real_s: float, repeats: int) -> SpeedTarget:
    """The same photo without depth; its plan is the viewer's, which decides that one view is enough."""
    flat = Disparity(np.zeros_like(real.disparity.values), "flat")
    plan = plan_for_viewing(real.photo, flat)
    flat_s = median_cost([cost_of(lambda: list(generate(real.photo, flat, plan))) for _ in range(repeats)]).cpu_s
    cheaper = real_s / max(flat_s, 1e-6)
    what = f"a flat photo against {real.name}"
    return SpeedTarget(what, f">= {FLAT_CHEAPER} times cheaper", f"{cheaper:.0f} times", cheaper >= FLAT_CHEAPER)
