"""Time and memory of work, on machines that do other things too.

Ways are run in turns, one round after the other, and compared within a round: what slows one slows its neighbours.
"""

from __future__ import annotations

import gc
import math
import time
from collections.abc import Callable, Mapping
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass
from functools import partial
from multiprocessing import get_context
from pathlib import Path
from typing import TypeVar

import numpy as np
import psutil

from benchmarks.harness.bench_scenes import BenchScene
from benchmarks.harness.environment import set_environment, thread_variables
from iibr_core.method.light_field import generate
from iibr_core.method.plan import plan_literal
from iibr_core.runtime.work import report_progress
from iibr_core.types import FloatImage, StoredColors

Result = TypeVar("Result")
PEAK_RESET, STATUS = Path("/proc/self/clear_refs"), Path("/proc/self/status")


@dataclass(frozen=True)
class Cost:
    """wall_s: what a clock on the wall shows. cpu_s: of all threads together, which other programs disturb less."""

    wall_s: float
    cpu_s: float

    def __add__(self, other: Cost) -> Cost:
        return Cost(self.wall_s + other.wall_s, self.cpu_s + other.cpu_s)

    def times(self, factor: float) -> Cost:
        """Return the cost of so many times as much work."""
        return Cost(factor * self.wall_s, factor * self.cpu_s)


def cost_of(work: Callable[[], object]) -> Cost:
    """Return the cost of one run of the work."""
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return Cost(time.perf_counter() - wall, time.process_time() - cpu)


def in_turns(ways: Mapping[str, Callable[[], Cost]], repeats: int) -> dict[str, list[Cost]]:
    """Return the costs of each way, one a round; every round goes through all ways."""
    found: dict[str, list[Cost]] = {name: [] for name in ways}
    for round_ in range(repeats):
        for k, (name, way) in enumerate(ways.items()):
            report_progress(round_ * len(ways) + k, repeats * len(ways), name)
            found[name].append(way())
    return found


def median_ratio(costs: list[Cost], reference: list[Cost]) -> float:
    """Return the median ratio of processor times, each to the reference of the same round."""
    ratios = [one.cpu_s / other.cpu_s for one, other in zip(costs, reference) if other.cpu_s > 0]
    return float(np.median(ratios)) if ratios else math.nan


def median_cost(costs: list[Cost]) -> Cost:
    """Return the medians of both times."""
    return Cost(float(np.median([c.wall_s for c in costs])), float(np.median([c.cpu_s for c in costs])))


def make_field(scene: BenchScene) -> list[tuple[StoredColors, FloatImage | None]]:
    """Return the colours and disparity of all views of a scene."""
    photo, disparity = scene.given
    updates = generate(photo, disparity, plan_literal(photo, disparity, scene.grid))
    return [(update.colors, update.disparity) for update in updates]


def field_costs(scenes: Mapping[str, BenchScene], repeats: int) -> dict[str, Cost]:
    """Return the medians of whole fields, made in turns, by name; compiling is not counted."""
    for scene in scenes.values():
        make_field(scene)
    ways = {name: partial(cost_of, partial(make_field, scene)) for name, scene in scenes.items()}
    return {name: median_cost(found) for name, found in in_turns(ways, repeats).items()}


def in_own_process(work: Callable[..., Result], *args: object) -> Result:
    """Return work(*args), done in a process that ends with it."""
    with ProcessPoolExecutor(1, get_context("spawn")) as process:
        return process.submit(work, *args).result()


def process_of(threads: int) -> ProcessPoolExecutor:
    """Return a process that uses so many threads; a context manager."""
    process = ProcessPoolExecutor(1, get_context("spawn"))
    with set_environment(thread_variables(threads)):
        process.submit(gc.collect).result()  # it starts with its first work
    return process


def added_bytes(work: Callable[[], object]) -> float:
    """Return the most memory that the work takes in this process beyond what was there before, its result included;
    NaN on systems other than Linux.
    """
    if not PEAK_RESET.exists():
        work()
        return math.nan
    PEAK_RESET.write_text("5")
    before = psutil.Process().memory_info().rss
    held = work()
    peak = _peak_rss()
    del held
    return float(peak - before)


def _peak_rss() -> int:
    line = next(line for line in STATUS.read_text().splitlines() if line.startswith("VmHWM"))
    return 1024 * int(line.split()[1])
