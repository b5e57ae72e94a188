"""What the plan predicts of a scene, beside what making it takes; and the plan's constants fitted to that."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from benchmarks.speed.measure import Cost, cost_of, in_turns, median_cost, peak_bytes
from benchmarks.speed.variants import BenchScene
from iibr_core.generation.cost_model import (
    CORES,
    NANOSECONDS,
    Workload,
    estimate_workload,
    largest_offset,
    measure_parallax,
)
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_literal
from iibr_core.types import Disparity, FloatImage, GridShape, Photo, Quality, ReportProgress, StoredColors

WITHIN = 0.25
"""A prediction is good if what was measured differs from it by no more than this share."""
LEAST_S = 0.1
"""Shorter runs are mostly overhead, and nobody waits for them."""


@dataclass(frozen=True, eq=False)
class BenchInput:
    """A scene to make: its field is the grid around the photo, at the disparity as it is."""

    name: str
    photo: Photo
    disparity: Disparity
    grid: GridShape


def whole_field(scene: BenchScene) -> BenchInput:
    """All views of a scene of the bench."""
    side = 2 * scene.reach + 1
    photo = Photo(scene.photo, float(scene.photo.shape[1]), scene.name)
    return BenchInput(scene.name, photo, Disparity(scene.disparity, "bench"), GridShape(side, side))


@dataclass(frozen=True)
class Prediction:
    """One scene in one quality. Bytes: of the views and of making them. seconds: processor time over all cores."""

    scene: str
    quality: Quality
    predicted_s: float
    measured_s: float
    predicted_bytes: float
    measured_bytes: float
    work: Workload

    @property
    def time_ratio(self) -> float:
        """Predicted over measured."""
        return self.predicted_s / self.measured_s if self.measured_s > 0 else math.nan

    @property
    def memory_ratio(self) -> float:
        """Predicted over measured; NaN where the system does not tell."""
        return self.predicted_bytes / self.measured_bytes if self.measured_bytes > 0 else math.nan


def is_near(ratio: float) -> bool | None:
    """Whether a ratio of predicted to measured is within the set share; None where it is not known."""
    return 1 - WITHIN <= ratio <= 1 + WITHIN if math.isfinite(ratio) else None


def make_field(given: BenchInput, quality: Quality) -> list[tuple[StoredColors, FloatImage | None]]:
    """All views as they are kept: colours and disparity."""
    plan = plan_literal(given.photo, given.disparity, given.grid)
    updates = generate(given.photo, given.disparity, plan, quality=quality)
    return [(update.colors, update.disparity) for update in updates]


def predict(
    scenes: Sequence[BenchInput], qualities: Sequence[Quality], repeats: int, report_progress: ReportProgress
) -> list[Prediction]:
    """Make every field in each quality, in turns, beside what the plan says of it."""
    pairs = [(given, quality) for given in scenes for quality in qualities]
    for given, quality in pairs:
        make_field(given, quality)  # compiles

    def way(given: BenchInput, quality: Quality) -> Callable[[], Cost]:
        return lambda: cost_of(lambda: make_field(given, quality))

    costs = in_turns(
        {f"{given.name}: {quality}": way(given, quality) for given, quality in pairs}, repeats, report_progress
    )
    seconds = [median_cost(found).cpu_s / CORES for found in costs.values()]
    return [_predict_one(given, quality, measured) for (given, quality), measured in zip(pairs, seconds)]


def _predict_one(given: BenchInput, quality: Quality, measured_s: float) -> Prediction:
    plan = plan_literal(given.photo, given.disparity, given.grid)
    need, memory = plan.costs.of(quality), peak_bytes(make_field, given, quality)
    work = estimate_workload(measure_parallax(given.disparity.values, largest_offset(given.grid)), given.grid, quality)
    return Prediction(given.name, quality, need.seconds, measured_s, plan.field_bytes + need.peak_bytes, memory, work)


def fit_nanoseconds(predicted: Sequence[Prediction]) -> Workload:
    """cost_model.NANOSECONDS as these measurements would set it, all above 0: least squares of the logarithms of
    predicted over measured, so that twice and half count alike.

    What no measurement contains keeps its value.
    """
    from scipy.optimize import least_squares, nnls

    long_enough = [f for f in predicted if f.measured_s >= LEAST_S]
    parts = np.array([np.array(f.work) * 1e-9 / CORES / f.measured_s for f in long_enough]).reshape(
        -1, len(Workload._fields)
    )
    known = parts.any(axis=0)
    values = np.array(NANOSECONDS)
    if known.any():
        first = np.log(np.maximum(nnls(parts[:, known], np.ones(len(parts)))[0], 1.0))
        values[known] = np.exp(least_squares(lambda logs: np.log(parts[:, known] @ np.exp(logs)), first).x)
    return Workload(*(float(value) for value in values))
