"""How long a cancelled field goes on: from the word to the end of the generator, at 4 MP.

    python -m benchmarks.cancel [--pixels 4000000] [--times 20] [--quality fast balanced]

The word comes at random moments of generating. The viewer's worker then drops the job. Target: 100 ms, which other
programs lengthen.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Iterator, Sequence
from typing import get_args

import numpy as np

from benchmarks.harness.reports import emit, head, parser_of, row, start
from iibr_core.method.light_field import generate
from iibr_core.method.plan import plan_literal
from iibr_core.types import (
    Disparity,
    GridShape,
    Photo,
    Quality,
)

GRID = GridShape(9, 9)
MOST_MS = 100
LAST_S = 4.0
"""The word comes within so many seconds."""
DRAFT_BYTES = 1 << 40
"""Drafts first, as the window has them made."""


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--pixels", type=int, default=4_000_000)
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--quality", nargs="+", default=get_args(Quality), choices=get_args(Quality))
    given = parser.parse_args()
    emit(report(given.pixels, given.times, given.quality))


def report(pixels: int, times: int, qualities: Sequence[Quality]) -> Iterator[str]:
    yield head("cancelled", "after, ms (median)", f"longest of {times}", f"over {MOST_MS} ms")
    photo, disparity = scene(pixels)
    for quality in qualities:
        wait_ms(*scene(5_000), quality, 1.0)  # compiles
        waits = np.sort([wait_ms(photo, disparity, quality, k / times) for k in range(times)])
        size = f"{photo.size[1]}x{photo.size[0]}"
        yield row(f"{quality}, {size}", f"{np.median(waits):.0f}", f"{waits[-1]:.0f}", (waits > MOST_MS).sum())


def scene(pixels: int) -> tuple[Photo, Disparity]:
    """Noise, and blocks at nine depths: many depth edges."""
    random, width = np.random.default_rng(0), round((pixels * 4 / 3) ** 0.5)
    height = pixels // width
    blocks = np.kron(random.integers(-4, 5, (12, 16)), np.ones((-(-height // 12), -(-width // 16))))
    colors = random.uniform(0, 1, (height, width, 3)).astype(np.float32)
    return Photo(colors, 1000.0, "blocks"), Disparity(blocks[:height, :width].astype(np.float32), "blocks")


def wait_ms(photo: Photo, disparity: Disparity, quality: Quality, share: float) -> float:
    """Cancel at some moment of the first seconds; how long until the generator ends."""
    stop, cancelled_at = threading.Event(), []

    def cancel() -> None:
        cancelled_at.append(time.perf_counter())
        stop.set()

    plan = plan_literal(photo, disparity, GRID)
    views = generate(photo, disparity, plan, stop.is_set, quality=quality, draft_bytes=DRAFT_BYTES)
    timer = threading.Timer(0.05 + LAST_S * share, cancel)
    timer.start()
    for _ in views:
        pass
    end = time.perf_counter()
    timer.join()
    return 1e3 * (end - cancelled_at[0]) if cancelled_at and end > cancelled_at[0] else 0.0


if __name__ == "__main__":
    start("benchmarks.cancel", main)
