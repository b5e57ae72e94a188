"""How time and memory grow with what a scene asks for: pixels, views, disparity range, depth edges.

Made-up scenes: a textured wall with textured squares before it, so that each can be changed alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from benchmarks.speed.measure import Cost, cost_of, exponent, in_turns, median_cost, peak_bytes
from benchmarks.speed.prediction import BenchInput, make_field
from iibr_core.generation.plan import plan_literal
from iibr_core.training.degradation import blur
from iibr_core.types import Disparity, GridShape, Photo, Quality, ReportProgress

TEXTURE_PX = 1.5
SQUARE_SHARE = 0.09
"""Side of a square, as a share of the picture's."""
FRONT_PX = 2.0


@dataclass(frozen=True)
class Point:
    """One made-up scene. x: what is varied. side: of the picture, px. range_px: disparity of the squares."""

    x: float
    side: int
    grid: int
    range_px: float
    squares: int
    quality: Quality = "fast"


@dataclass(frozen=True)
class Growth:
    """points: (x, seconds, bytes) each. time_exponent, memory_exponent: both grow like x to this power."""

    name: str
    points: tuple[tuple[float, float, float], ...]
    time_exponent: float
    memory_exponent: float


def made_up_scene(side: int, range_px: float, squares: int) -> tuple[Photo, Disparity]:
    """A photo of side x side px and its disparity: a wall at 0, squares anywhere before it at range_px / 2 and more."""
    rng = np.random.default_rng(0)
    pixels = np.stack([blur(rng.random((side, side)).astype(np.float32), TEXTURE_PX) for _ in range(3)], axis=-1)
    pixels = np.clip(0.5 + 2 * (pixels - 0.5), 0, 1).astype(np.float32)
    disparity = np.zeros((side, side), np.float32)
    length = max(round(SQUARE_SHARE * side), 1)
    for _ in range(squares):
        y, x = rng.integers(0, side - length + 1, 2)
        square = np.s_[y : y + length, x : x + length]
        disparity[square] = range_px * rng.uniform(0.5, 1.0)
        pixels[square] = pixels[square] * rng.uniform(0.3, 1.0, 3).astype(np.float32)
    return Photo(pixels, float(side), "made up"), Disparity(disparity, "made up")


def series(quick: bool) -> dict[str, list[Point]]:
    """What is varied, and the scenes; quick: fewer and smaller ones."""
    base, grid = (96, 3) if quick else (256, 5)
    sides = (64, 96, 128) if quick else (128, 181, 256, 362, 512, 724, 1024)
    grids = (3, 5) if quick else (3, 5, 7, 9, 13)
    ranges = (1.0, 4.0) if quick else (0.5, 1.0, 2.0, 4.0, 8.0)
    counts = (1, 8) if quick else (2, 8, 32, 128)
    found = {
        "pixels": [Point(float(side * side), side, grid, FRONT_PX, 16) for side in sides],
        "views": [Point(float(n * n), base, n, FRONT_PX, 16) for n in grids],
        "disparity range": [Point(range_px, base, grid, range_px, 16) for range_px in ranges],
    }
    for quality in ("fast", "balanced"):
        found[f"pixels near depth edges, {quality}"] = [
            Point(edges_of(base, grid, count), base, grid, FRONT_PX, count, quality) for count in counts
        ]
    return found


def edges_of(side: int, grid: int, squares: int) -> float:
    """Share of the pixels near a depth edge, as the plan counts it."""
    given = made_up_field(Point(0.0, side, grid, FRONT_PX, squares))
    return plan_literal(given.photo, given.disparity, given.grid).edge_fraction


def growth(name: str, points: list[Point], repeats: int, report_progress: ReportProgress) -> Growth:
    """Measure a series, its scenes in turns."""
    scenes = [made_up_field(point) for point in points]
    make_field(scenes[0], points[0].quality)  # compiles

    def way(given: BenchInput, quality: Quality) -> Callable[[], Cost]:
        return lambda: cost_of(lambda: make_field(given, quality))

    ways = {f"{name}: {point.x:g}": way(given, point.quality) for given, point in zip(scenes, points)}
    seconds = [median_cost(costs).cpu_s for costs in in_turns(ways, repeats, report_progress).values()]
    memory = [peak_bytes(make_field, given, point.quality) for given, point in zip(scenes, points)]
    x = [point.x for point in points]
    return Growth(name, tuple(zip(x, seconds, memory)), exponent(x, seconds), exponent(x, memory))


def made_up_field(point: Point) -> BenchInput:
    """The scene of a point."""
    photo, disparity = made_up_scene(point.side, point.range_px, point.squares)
    return BenchInput("made up", photo, disparity, GridShape(point.grid, point.grid))
