"""What the plan predicts beside what is measured; constants fitted again on some scenes and judged on others.

    python -m benchmarks.prediction [--data DATA] [--photos DIR] [--qualities fast,balanced] [--only WORDS]

Scenes of DATA, squares and some scenes that training draws are what constants are fitted to. Judged are other drawn
scenes, the demo photo and the photos with depth of their own below DIR. Run it on a machine that does nothing else, put
what the last line says into `iibr_core/generation/cost_model.py`, and run it again. Time is processor time over all
cores; a prediction is good if it is within a quarter of what was measured.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import get_args

import numpy as np
from iibr_core.generation.cost_model import (
    CORES,
    NANOSECONDS,
    Workload,
    estimate_workload,
    largest_offset,
    measure_parallax,
)

from benchmarks.harness.bench_scenes import DEMO, BenchScene, data_scenes, drawn_scene, photo_scene, squares_scene
from benchmarks.harness.reports import emit, head, holds, is_wanted, parser_of, row, start, title
from benchmarks.harness.timing import field_costs, make_field, peak_bytes
from iibr_core.evaluation.tables import number
from iibr_core.method.memory import scene_bytes
from iibr_core.method.plan import plan_literal
from iibr_core.types import GridShape, ImageSize, Quality

WITHIN = 0.25
LEAST_S = 0.1
"""Shorter runs are mostly overhead, and nobody waits for them."""
SQUARES = ((1024, 2.0, 16, 9), (512, 2.0, 16, 9), (256, 2.0, 128, 5), (256, 8.0, 16, 13))
"""Side px, disparity range px, squares, views a side."""
DRAWN_TO_FIT = ((201, 360, 480, 16.0, 9), (202, 240, 320, 24.0, 5), (203, 480, 640, 8.0, 5), (204, 300, 300, 12.0, 13))
DRAWN = ((104, 240, 320, 8.0, 13), (102, 300, 400, 30.0, 9), (106, 400, 600, 6.0, 9), (105, 512, 512, 45.0, 7),
         (101, 480, 640, 12.0, 9), (103, 600, 800, 20.0, 5))  # fmt: skip
"""Seed, height, width, largest parallax px, views a side: these are judged, those above fitted to."""
PHOTO_EXTENSIONS = (".jpg", ".jpeg", ".heic")
MIB = 2**20


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


def main() -> None:
    parser = parser_of(__doc__, "data", "repeats", "only", "out")
    parser.add_argument("--photos", type=Path)
    parser.add_argument("--qualities", default=",".join(get_args(Quality)))
    options = parser.parse_args()
    qualities = [quality for quality in get_args(Quality) if quality in options.qualities.split(",")]
    sets = {"fitted to": fitted_scenes(options.data), "judged by": judged_scenes(options.photos)}
    emit(report(sets, qualities, options.repeats, options.only), options.out)


def report(
    sets: dict[str, Iterator[BenchScene]], qualities: Sequence[Quality], repeats: int, only: str
) -> Iterator[str]:
    """The lines of the report, a scene at a time."""
    yield title("The plan beside what was measured", "benchmarks.prediction")
    yield head("scene", "quality", "s predicted", "measured", "ratio", "MiB predicted", "measured", "ratio", "holds")
    found: dict[str, list[Prediction]] = {name: [] for name in sets}
    for name, scenes in sets.items():
        for scene in scenes:
            for f in predict(scene, qualities, repeats) if is_wanted(scene.name, only) else ():
                found[name].append(f)
                seconds = (number(value, 2) for value in (f.predicted_s, f.measured_s, f.time_ratio))
                sizes = (number(value / MIB, 0) for value in (f.predicted_bytes, f.measured_bytes))
                is_good = is_near(f.time_ratio) and is_near(f.memory_ratio) is not False
                yield row(f.scene, f.quality, *seconds, *sizes, number(f.memory_ratio, 2), holds(is_good))
    constants = fit_nanoseconds(found["fitted to"])
    yield ""
    for name, each in found.items():
        yield sum_up(f"{name}, constants now: time", (f.time_ratio for f in each))
        fitted = (sum(map(math.prod, zip(f.work, constants))) * 1e-9 / CORES / f.measured_s for f in each)
        yield sum_up(f"{name}, constants fitted: time", fitted)
        yield sum_up(f"{name}: memory", (f.memory_ratio for f in each))
    yield "- now: " + ", ".join(f"{name}={value:.0f}" for name, value in zip(NANOSECONDS._fields, NANOSECONDS))
    yield "- fitted: " + ", ".join(f"{name}={value:.0f}" for name, value in zip(NANOSECONDS._fields, constants))


def sum_up(what: str, ratios: Iterable[float]) -> str:
    """How many are near, and from where to where they reach."""
    known = [ratio for ratio in ratios if math.isfinite(ratio)]
    near = sum(map(bool, map(is_near, known)))
    reach = f", from {min(known):.2f} to {max(known):.2f}" if known else ""
    return f"- {what}: {near} of {len(known)} within {WITHIN:.0%}{reach}"


def fitted_scenes(data: Path | None) -> Iterator[BenchScene]:
    """Squares, drawn ones, and real ones with maps as they are and soft ones."""
    for side, range_px, squares, views in SQUARES:
        yield squares_scene(side, range_px, squares, GridShape(views, views))
    for each in DRAWN_TO_FIT:
        yield drawn(*each)
    yield from data_scenes(data)


def judged_scenes(photos: Path | None) -> Iterator[BenchScene]:
    """Those that no constant is fitted to, the smallest first; photos with the field that their plan gives them."""
    for each in DRAWN:
        yield drawn(*each)
    below = sorted(photos.rglob("*")) if photos else []
    for path in [DEMO, *(path for path in below if path.suffix.lower() in PHOTO_EXTENSIONS)]:
        if scene := photo_scene(path):
            yield scene


def drawn(seed: int, height: int, width: int, parallax_px: float, side: int) -> BenchScene:
    """Of so many views a side."""
    return drawn_scene(seed, ImageSize(height, width), parallax_px / (side // 2), GridShape(side, side))


def predict(scene: BenchScene, qualities: Sequence[Quality], repeats: int) -> Iterator[Prediction]:
    """Make a field in each quality, in turns, beside what the plan says of it."""
    costs = field_costs({quality: (scene, quality) for quality in qualities}, repeats)
    plan = plan_literal(*scene.given, scene.grid)
    for quality in qualities:
        measured_s, memory = costs[quality].cpu_s / CORES, peak_bytes(make_field, scene, quality)
        need, parallax = plan.costs.of(quality), measure_parallax(scene.disparity, largest_offset(scene.grid))
        work = estimate_workload(parallax, scene.grid, quality)
        predicted_bytes = scene_bytes(math.prod(scene.given[0].size), plan.field_bytes)
        yield Prediction(scene.name, quality, need.seconds, measured_s, predicted_bytes, memory, work)


def fit_nanoseconds(predicted: Sequence[Prediction]) -> Workload:
    """cost_model.NANOSECONDS as these measurements would set it, all above 0: least squares of the logarithms of
    predicted over measured, so that twice and half count alike.

    What no measurement contains keeps its value.
    """
    from scipy.optimize import least_squares, nnls

    long_enough = [f for f in predicted if f.measured_s >= LEAST_S]
    parts = np.array([np.array(f.work) * 1e-9 / CORES / f.measured_s for f in long_enough])
    parts = parts.reshape(-1, len(Workload._fields))
    known = parts.any(axis=0)
    values = np.array(NANOSECONDS)
    if known.any():
        first = np.log(np.maximum(nnls(parts[:, known], np.ones(len(parts)))[0], 1.0))
        values[known] = np.exp(least_squares(lambda logs: np.log(parts[:, known] @ np.exp(logs)), first).x)
    return Workload(*(float(value) for value in values))


if __name__ == "__main__":
    start("benchmarks.prediction", main)
