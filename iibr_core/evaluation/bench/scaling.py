"""How time and memory grow with what a scene asks for: pixels, views, disparity range, depth edges.

Made-up scenes: a textured wall with textured squares before it, so that each can be changed alone.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from iibr_core.evaluation.bench.measure import Cost, cost_of, exponent, in_turns, median_cost, peak_bytes
from iibr_core.generate import generate
from iibr_core.plan import ScenePlan, plan_literal
from iibr_core.training.degrade import blurred
from iibr_core.types import Disparity, GridShape, Photo, Quality

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


def made_up(side: int, range_px: float, squares: int, seed: int = 0) -> tuple[Photo, Disparity]:
    """A photo of side x side px and its disparity: a wall at 0, squares anywhere before it at range_px / 2 and more."""
    rng = np.random.default_rng(seed)
    pixels = np.stack([blurred(rng.random((side, side)).astype(np.float32), TEXTURE_PX) for _ in range(3)], axis=-1)
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
    return _planned(Point(0.0, side, grid, FRONT_PX, squares))[2].edge_fraction


def growth(name: str, points: list[Point], repeats: int, tell: Callable[[int, int, str], None]) -> Growth:
    """Measure a series, its scenes in turns."""
    scenes = [_planned(point) for point in points]

    def run(k: int) -> object:
        photo, disparity, plan = scenes[k]
        return list(generate(photo, disparity, plan, quality=points[k].quality))

    run(0)  # compiles

    def way(k: int) -> Callable[[], Cost]:
        return lambda: cost_of(lambda: run(k))

    ways = {f"{name}: {point.x:g}": way(k) for k, point in enumerate(points)}
    seconds = [median_cost(costs).cpu_s for costs in in_turns(ways, repeats, tell).values()]
    memory = [peak_bytes(partial(run, k)) for k in range(len(points))]
    x = [point.x for point in points]
    return Growth(name, tuple(zip(x, seconds, memory)), exponent(x, seconds), exponent(x, memory))


def _planned(point: Point) -> tuple[Photo, Disparity, ScenePlan]:
    photo, disparity = made_up(point.side, point.range_px, point.squares)
    return photo, disparity, plan_literal(photo, disparity, GridShape(point.grid, point.grid))
