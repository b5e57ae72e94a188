"""What the bench measures of real scenes: the cost and the error of every variant, and which the plan would choose."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from benchmarks.speed.measure import Cost, in_turns, median_cost, median_ratio, on_the_front, peak_bytes
from benchmarks.speed.prediction import whole_field
from benchmarks.speed.variants import REFERENCE, BenchScene, Draw, Variant, evaluated_views, field_cost, is_possible
from iibr_core.evaluation.metrics import bounded_psnr, flip
from iibr_core.generation.plan import PlanOverrides, plan_for_viewing, plan_literal
from iibr_core.generation.relief import measure_relief
from iibr_core.types import TOTAL_PARALLAX, ReportProgress


@dataclass(frozen=True)
class MeasuredVariant:
    """One variant on one scene. cost: of the whole field; ratio: of processor time to the reference; peak_bytes: beyond
    what was there before; psnr_db, flip: means over the judged views.
    """

    variant: Variant
    cost: Cost
    ratio: float
    peak_bytes: float
    psnr_db: float
    flip: float


@dataclass(frozen=True)
class SceneFigures:
    """size: (height, width). planned: name of the variant of the quality, and with as many stored views, as the
    plan would choose.
    """

    name: str
    size: tuple[int, int]
    views: int
    judged: int
    measured: tuple[MeasuredVariant, ...]
    planned: str
    is_soft: bool = False

    @property
    def front(self) -> set[str]:
        """Variants that none beats in time and PSNR both."""
        return on_the_front({m.variant.name: (m.ratio, m.psnr_db) for m in self.measured})

    @property
    def choice(self) -> MeasuredVariant:
        """The plan's."""
        return next(m for m in self.measured if m.variant.name == self.planned)

    @property
    def behind_front_db(self) -> float:
        """By how much the plan's choice falls short of the best variant that takes no longer."""
        return max(m.psnr_db for m in self.measured if m.ratio <= self.choice.ratio) - self.choice.psnr_db

    def fastest_as_good(self, within_db: float) -> MeasuredVariant:
        """The fastest variant that falls short of the plan's choice by no more than that."""
        as_good = [m for m in self.measured if m.psnr_db >= self.choice.psnr_db - within_db]
        return min(as_good, key=lambda m: m.ratio)


def measure_scene(
    scene: BenchScene,
    variants: Sequence[Variant],
    repeats: int,
    report_progress: ReportProgress,
    draw: Draw | None = None,
) -> SceneFigures:
    """Every possible variant on one scene, timed in turns. draw: what fills in where views are left out."""
    possible = [variant for variant in variants if is_possible(variant, scene, draw is not None)]
    if REFERENCE not in possible:
        possible.insert(0, REFERENCE)

    def way(variant: Variant) -> Callable[[], Cost]:
        return lambda: field_cost(variant, scene)

    def report(done: float, total: float, doing: str) -> None:
        report_progress(done, total, f"{scene.name}: {doing}")

    errors = {}
    for k, variant in enumerate(possible):
        report(k, len(possible), f"error of {variant.name}")
        errors[variant] = _errors(variant, scene, draw)
    costs = in_turns({variant.name: way(variant) for variant in possible}, repeats, report)
    measured = []
    for variant in possible:
        own, reference = costs[variant.name], costs[REFERENCE.name]
        memory = peak_bytes(field_cost, variant, scene)
        ratio = median_ratio(own, reference)
        measured.append(MeasuredVariant(variant, median_cost(own), ratio, memory, *errors[variant]))
    size = (scene.photo.shape[0], scene.photo.shape[1])
    planned = _plan_choice(scene, possible)
    return SceneFigures(scene.name, size, len(scene.field), len(scene.truth), tuple(measured), planned, scene.is_soft)


def _errors(variant: Variant, scene: BenchScene, draw: Draw | None) -> tuple[float, float]:
    """Mean PSNR and FLIP over the judged views."""
    made = evaluated_views(variant, scene, draw)
    errors = [(bounded_psnr(image, scene.truth[at]), flip(image, scene.truth[at])) for at, image in made.items()]
    mean_psnr, mean_flip = np.mean(errors, axis=0)
    return float(mean_psnr), float(mean_flip)


def _plan_choice(scene: BenchScene, variants: Sequence[Variant]) -> str:
    """The plan's quality, with as few stored views as it finds enough for this parallax."""
    field, full = whole_field(scene), 2 * scene.reach
    moved_px = measure_relief(scene.disparity).range * full
    strength = max(moved_px / (TOTAL_PARALLAX * scene.photo.shape[1]), 1e-6)
    side = plan_for_viewing(field.photo, field.disparity, PlanOverrides(depth_strength=strength)).grid.columns
    chosen = Variant("", plan_literal(field.photo, field.disparity, field.grid).quality)
    plain = [variant for variant in variants if replace(variant, name="", every=1) == chosen and variant.every > 0]
    enough = [variant for variant in plain if full // variant.every + 1 >= min(side, full + 1)]
    return max(enough, key=lambda variant: variant.every, default=REFERENCE).name
