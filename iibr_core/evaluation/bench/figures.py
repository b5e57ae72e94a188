"""What the bench measures of real scenes: every variant's cost and error, what the plan foretold, and set targets."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from iibr_core.evaluation.bench.measure import (
    Cost,
    cost_of,
    in_turns,
    median_cost,
    median_ratio,
    on_the_front,
    peak_bytes,
)
from iibr_core.evaluation.bench.scaling import made_up
from iibr_core.evaluation.bench.variants import (
    REFERENCE,
    BenchScene,
    Draw,
    Variant,
    field_cost,
    is_possible,
    judged_views,
)
from iibr_core.evaluation.metrics import flip, psnr
from iibr_core.generate import generate
from iibr_core.plan import RAY_US, TOTAL_PARALLAX, PlanOverrides, ScenePlan, plan_for_viewing, plan_literal
from iibr_core.types import DEFAULT_QUALITY, Disparity, GridShape, Photo, Quality

CORES = os.cpu_count() or 1
MEGAPIXEL_SIDE = 1024
SQUARES = 16

Tell = Callable[[int, int, str], None]


@dataclass(frozen=True)
class Measured:
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
    """size: (height, width). planned: name of the variant that stores as many views as the plan would choose."""

    name: str
    size: tuple[int, int]
    views: int
    judged: int
    measured: tuple[Measured, ...]
    planned: str
    is_soft: bool = False

    @property
    def front(self) -> set[str]:
        """Variants that none beats in time and PSNR both."""
        return on_the_front({m.variant.name: (m.ratio, m.psnr_db) for m in self.measured})

    @property
    def behind_front_db(self) -> float:
        """By how much the plan's choice falls short of the best variant that takes no longer."""
        own = next(m for m in self.measured if m.variant.name == self.planned)
        return max(m.psnr_db for m in self.measured if m.ratio <= own.ratio) - own.psnr_db


@dataclass(frozen=True)
class Foretold:
    """The plan beside a measured run. transformer_s: of balanced quality alone, on all cores."""

    scene: str
    quality: Quality
    foretold_bytes: float
    measured_bytes: float
    foretold_transformer_s: float
    measured_transformer_s: float
    seconds: float


@dataclass(frozen=True)
class Target:
    """One figure with its target, in words."""

    what: str
    target: str
    measured: str
    is_met: bool | None


def measure_scene(
    scene: BenchScene, variants: Sequence[Variant], repeats: int, tell: Tell, draw: Draw | None = None
) -> SceneFigures:
    """Every possible variant on one scene, timed in turns. draw: what fills in where views are left out."""
    possible = [variant for variant in variants if is_possible(variant, scene, draw is not None)]
    if REFERENCE not in possible:
        possible.insert(0, REFERENCE)
    errors: dict[str, tuple[float, float]] = {}
    for k, variant in enumerate(possible):
        tell(k, len(possible), f"{scene.name}: error of {variant.name}")
        made = judged_views(variant, scene, draw)
        errors[variant.name] = (
            float(np.mean([psnr(image, scene.truth[at]) for at, image in made.items()])),
            float(np.mean([flip(image, scene.truth[at]) for at, image in made.items()])),
        )

    def way(variant: Variant) -> Callable[[], Cost]:
        return lambda: field_cost(variant, scene)

    costs = in_turns(
        {variant.name: way(variant) for variant in possible},
        repeats,
        lambda done, total, name: tell(done, total, f"{scene.name}: {name}"),
    )
    measured = tuple(
        Measured(
            variant,
            median_cost(costs[variant.name]),
            median_ratio(costs[variant.name], costs[REFERENCE.name]),
            peak_bytes(way(variant)),
            *errors[variant.name],
        )
        for variant in possible
    )
    size = (scene.photo.shape[0], scene.photo.shape[1])
    planned = _planned(scene, [m.variant for m in measured])
    return SceneFigures(scene.name, size, len(scene.field), len(scene.truth), measured, planned, scene.is_soft)


def _planned(scene: BenchScene, variants: Sequence[Variant]) -> str:
    """The default quality with as few stored views as the plan finds enough for this parallax."""
    low, high = (float(p) for p in np.percentile(scene.disparity, (1, 99)))
    width = scene.photo.shape[1]
    strength = (high - low) * 2 * scene.reach / (TOTAL_PARALLAX * width)
    photo, disparity = Photo(scene.photo, float(width), scene.name), Disparity(scene.disparity, "bench")
    side = plan_for_viewing(photo, disparity, PlanOverrides(depth_strength=max(strength, 1e-6))).grid.columns
    default = Variant("", DEFAULT_QUALITY)
    plain = [variant for variant in variants if replace(variant, name="", every=1) == default]
    with_sides = {v.name: 2 * scene.reach // v.every + 1 for v in plain if v.every > 0}
    enough = {name: stored for name, stored in with_sides.items() if stored >= min(side, 2 * scene.reach + 1)}
    return min(enough, key=lambda name: enough[name], default=REFERENCE.name)


def foretell(scene: BenchScene, qualities: Sequence[Quality], tell: Tell) -> list[Foretold]:
    """Make the whole field once in each quality, beside what the plan says of it."""
    photo = Photo(scene.photo, float(scene.photo.shape[1]), scene.name)
    disparity = Disparity(scene.disparity, "bench")
    side = 2 * scene.reach + 1
    plan = plan_literal(photo, disparity, GridShape(side, side))
    found: list[Foretold] = []
    fast = math.nan
    for k, quality in enumerate(qualities):
        tell(k, len(qualities), f"{scene.name}: the plan beside {quality}")

        def run(quality: Quality = quality) -> object:
            return list(generate(photo, disparity, plan, quality=quality))

        seconds = cost_of(run).cpu_s / CORES
        fast = seconds if quality == "fast" else fast
        found.append(
            Foretold(
                scene.name,
                quality,
                plan.field_bytes + plan.peak_bytes,
                peak_bytes(run),
                _transformer_s(plan, quality, disparity.values.size),
                seconds - fast,
                seconds,
            )
        )
    return found


def _transformer_s(plan: ScenePlan, quality: Quality, pixels: int) -> float:
    rays = pixels * (plan.grid.rows * plan.grid.columns - 1) * RAY_US * 1e-6 / CORES
    return {"fast": 0.0, "balanced": rays * plan.edge_fraction, "exact": rays}[quality]


def targets(scene: BenchScene, repeats: int, tell: Tell) -> list[Target]:
    """The set figures that one scene and made-up ones can show; the scene should be a 9x9 field of 512x512."""
    height, width = scene.photo.shape[:2]
    side = 2 * scene.reach + 1
    real = Photo(scene.photo, float(width), scene.name), Disparity(scene.disparity, "bench")
    large = made_up(MEGAPIXEL_SIDE, 2.0, SQUARES)
    flat = real[0], Disparity(np.zeros((height, width), np.float32), "bench")
    plans = {
        "real": plan_literal(*real, GridShape(side, side)),
        "large": plan_literal(*large, GridShape(9, 9)),
        "flat": plan_for_viewing(*flat),
    }
    sources = {"real": real, "large": large, "flat": flat}

    def run(name: str, quality: Quality) -> object:
        return list(generate(*sources[name], plans[name], quality=quality))

    ways = {
        f"{name}, {quality}": (lambda name=name, quality=quality: cost_of(lambda: run(name, quality)))
        for name, quality in (("real", "fast"), ("real", "balanced"), ("large", "fast"), ("large", "balanced"))
    }
    costs = {name: median_cost(found) for name, found in in_turns(ways, repeats, tell).items()}
    flat_s = median_cost([cost_of(lambda: run("flat", "fast")) for _ in range(5 * repeats)])
    memory = peak_bytes(lambda: run("large", "balanced")) / plans["large"].field_bytes
    cheaper = costs["real, fast"].cpu_s / max(flat_s.cpu_s, 1e-6)
    grid = f"{side}x{side} of {width}x{height}"
    return [
        *(_time_target(f"{grid}, {quality}, warm", costs[f"real, {quality}"], 1.5) for quality in ("fast", "balanced")),
        *(_time_target(f"9x9 of 1 MP, {quality}", costs[f"large, {quality}"], 5.0) for quality in ("fast", "balanced")),
        Target(
            "9x9 of 1 MP, peak memory over the light field's", "<= 2.5", f"{memory:.2f}",
            memory <= 2.5 if math.isfinite(memory) else None,
        ),
        Target(f"a flat photo against {scene.name}", ">= 20 times cheaper", f"{cheaper:.0f} times", cheaper >= 20),
    ]  # fmt: skip


def _time_target(what: str, cost: Cost, most_s: float) -> Target:
    """Judged by processor time over all cores: what the wall clock shows on a machine that does nothing else."""
    alone = cost.cpu_s / CORES
    said = f"{alone:.2f} s of processor time over {CORES} cores ({cost.wall_s:.2f} s by the clock)"
    return Target(what, f"<= {most_s:g} s", said, alone <= most_s)
