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
from functools import cache
from multiprocessing import get_context
from pathlib import Path

import numpy as np
import psutil

from iibr_core.types import ReportProgress
from viewer.app.batch.threads import set_environment

PEAK_RESET, STATUS = Path("/proc/self/clear_refs"), Path("/proc/self/status")


@dataclass(frozen=True)
class Cost:
    """wall_s: what a clock on the wall shows. cpu_s: of all threads together, which other programs disturb less."""

    wall_s: float
    cpu_s: float

    def __add__(self, other: Cost) -> Cost:
        return Cost(self.wall_s + other.wall_s, self.cpu_s + other.cpu_s)

    def times(self, factor: float) -> Cost:
        """That many times as much."""
        return Cost(factor * self.wall_s, factor * self.cpu_s)


def cost_of(work: Callable[[], object]) -> Cost:
    """What one run of the work costs."""
    wall, cpu = time.perf_counter(), time.process_time()
    work()
    return Cost(time.perf_counter() - wall, time.process_time() - cpu)


def in_turns(
    ways: Mapping[str, Callable[[], Cost]], repeats: int, report_progress: ReportProgress
) -> dict[str, list[Cost]]:
    """The costs that each way gives, one a round; every round goes through all ways."""
    found: dict[str, list[Cost]] = {name: [] for name in ways}
    for round_ in range(repeats):
        for k, (name, way) in enumerate(ways.items()):
            report_progress(round_ * len(ways) + k, repeats * len(ways), name)
            found[name].append(way())
    return found


def median_ratio(costs: list[Cost], reference: list[Cost]) -> float:
    """Of processor times, each against the reference of its own round."""
    ratios = [one.cpu_s / other.cpu_s for one, other in zip(costs, reference) if other.cpu_s > 0]
    return float(np.median(ratios)) if ratios else math.nan


def median_cost(costs: list[Cost]) -> Cost:
    """Medians of both times."""
    return Cost(float(np.median([c.wall_s for c in costs])), float(np.median([c.cpu_s for c in costs])))


def peak_bytes(work: Callable[..., object], *args: object) -> float:
    """The most memory that work(*args) takes beyond what was there before, what it returns held until then; the second
    of two runs counts, in a process of its own. NaN where the system does not tell (all but Linux).

    work: a function of a module; it and args are pickled.
    """
    return _gauge().submit(_peak_of, work, args).result() if PEAK_RESET.exists() else math.nan


@cache
def _gauge() -> ProcessPoolExecutor:
    """A process that gives freed arrays back to the system at once: kept ones would hide what is taken anew."""
    with set_environment({"MALLOC_MMAP_THRESHOLD_": str(1 << 17)}):
        gauge = ProcessPoolExecutor(1, get_context("spawn"))
        gauge.submit(gc.collect).result()  # it starts with its first work
    return gauge


def _peak_of(work: Callable[..., object], args: tuple[object, ...]) -> float:
    work(*args)
    gc.collect()
    PEAK_RESET.write_text("5")
    before = psutil.Process().memory_info().rss
    held = work(*args)
    peak = _peak_rss()
    del held
    return float(peak - before)


def _peak_rss() -> int:
    line = next(line for line in STATUS.read_text().splitlines() if line.startswith("VmHWM"))
    return 1024 * int(line.split()[1])


def exponent(x: list[float], y: list[float]) -> float:
    """Slope of log y over log x by least squares: y grows like x to this power. NaN with fewer than two positive x."""
    pairs = [(math.log(a), math.log(b)) for a, b in zip(x, y) if a > 0 and b > 0 and math.isfinite(a * b)]
    if len({a for a, _ in pairs}) < 2:
        return math.nan
    a, b = np.array(pairs).T
    return float(np.polyfit(a, b, 1)[0])


def on_the_front(points: Mapping[str, tuple[float, float]]) -> set[str]:
    """Names of the points (cost, gain) that no other beats: none is as cheap and better, or as good and cheaper."""

    def is_beaten(name: str) -> bool:
        cost, gain = points[name]
        return any(c <= cost and g >= gain and (c, g) != (cost, gain) for c, g in points.values())

    return {name for name, (cost, gain) in points.items() if math.isfinite(cost * gain) and not is_beaten(name)}
