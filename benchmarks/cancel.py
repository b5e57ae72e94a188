"""Measures how long a cancelled field takes to end: from the request to the end of the generator, at 4 MP.

    python -m benchmarks.cancel [--pixels 4000000] [--times 20]

The request comes at evenly spaced moments of generating. Target: 100 ms, which other programs lengthen.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator

import numpy as np

from benchmarks.harness.reports import emit, head, parser_of, row, start
from iibr_core.method.light_field import generate
from iibr_core.method.plan import plan_literal
from iibr_core.runtime.work import stoppable
from iibr_core.types import (
    Disparity,
    GridShape,
    Photo,
)

GRID = GridShape(9, 9)
MOST_MS = 100
LAST_S = 4.0
"""Seconds within which the request comes."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--pixels", type=int, default=4_000_000)
    parser.add_argument("--times", type=int, default=20)
    given = parser.parse_args()
    emit(report(given.pixels, given.times))


def report(pixels: int, times: int) -> Iterator[str]:
    yield head("pixels", "after, ms (median)", f"longest of {times}", f"over {MOST_MS} ms")
    photo, disparity = scene(pixels)
    wait_ms(*scene(5_000), 1.0)  # compiles
    waits = np.sort([wait_ms(photo, disparity, k / times) for k in range(times)])
    yield row(photo.size, f"{np.median(waits):.0f}", f"{waits[-1]:.0f}", (waits > MOST_MS).sum())


def scene(pixels: int) -> tuple[Photo, Disparity]:
    """Noise, and blocks at nine depths: many depth edges."""
    random, width = np.random.default_rng(0), round((pixels * 4 / 3) ** 0.5)
    height = pixels // width
    blocks = np.kron(random.integers(-4, 5, (12, 16)), np.ones((-(-height // 12), -(-width // 16))))
    colors = random.uniform(0, 1, (height, width, 3)).astype(np.float32)
    return Photo(colors, 1000.0, "blocks"), Disparity(blocks[:height, :width].astype(np.float32), "blocks")


def wait_ms(photo: Photo, disparity: Disparity, share: float) -> float:
    """Cancel at this share of the first seconds; return the milliseconds until the generator ends."""
    stop, cancelled_at = threading.Event(), []

    def cancel() -> None:
        cancelled_at.append(time.perf_counter())
        stop.set()

    plan = plan_literal(photo, disparity, GRID)
    timer = threading.Timer(0.05 + LAST_S * share, cancel)
    timer.start()
    with stoppable(stop.is_set):
        for _ in generate(photo, disparity, plan):
            pass
    end = time.perf_counter()
    timer.join()
    return 1e3 * (end - cancelled_at[0]) if cancelled_at and end > cancelled_at[0] else 0.0


if __name__ == "__main__":
    start("benchmarks.cancel", main)
