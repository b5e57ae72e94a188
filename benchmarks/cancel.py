"""How long a cancelled field goes on: from the word to the end of the generator, at 4 MP.

    python -m benchmarks.cancel [--pixels 4000000] [--times 20] [--quality fast balanced]

The word comes at random moments of generating. The viewer's worker then drops the job. Target: 100 ms. Other programs
lengthen that, so the longest pieces of work between two questions whether to stop stand beside it, in processor time of
their thread: of views, and of what finds depth before them.
"""

from __future__ import annotations

import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from typing import get_args

import numpy as np

from benchmarks.harness.report import emit, head, parser_of, row, start
from iibr_core.depth.edges.refine import refine
from iibr_core.depth.pictorial_cues import estimate_from_cues
from iibr_core.generation.light_field import generate
from iibr_core.generation.plan import plan_literal
from iibr_core.runtime.tiling import ShouldStop
from iibr_core.types import Disparity, GridShape, Photo, Quality, ViewUpdate

GRID = GridShape(9, 9)
MOST_MS = 100
LAST_S = 4.0
"""The word comes within so many seconds."""
WATCHED_GRID = GridShape(5, 4)
"""Made to the end, drafts finished: the photo's own view, the farthest, and some of the others."""
DRAFT_BYTES = 1 << 40
BLUR_PX = 9


class Watch:
    """A should_stop that never says so. longest_ms: processor time of the longest pieces, by where they end."""

    def __init__(self) -> None:
        self.longest_ms: dict[str, float] = {}
        self._threads = threading.local()

    def __call__(self) -> bool:
        """Ends a piece of the thread that asks, and begins its next."""
        now = time.thread_time()
        piece = 1e3 * (now - getattr(self._threads, "last", now))
        place = _asker()
        self.longest_ms[place] = max(self.longest_ms.get(place, 0.0), piece)
        self._threads.last = time.thread_time()
        return False

    def in_words(self) -> str:
        """The longest pieces in words."""
        longest = sorted(self.longest_ms.items(), key=lambda item: -item[1])[:3]
        return ", ".join(f"{ms:.0f} ms before {place}" for place, ms in longest)


def main() -> None:
    parser = parser_of(__doc__)
    parser.add_argument("--pixels", type=int, default=4_000_000)
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--quality", nargs="+", default=get_args(Quality), choices=get_args(Quality))
    given = parser.parse_args()
    emit(report(given.pixels, given.times, given.quality))


def report(pixels: int, times: int, qualities: Sequence[Quality]) -> Iterator[str]:
    longest = "longest of {times}", f"over {MOST_MS} ms", "longest pieces, processor time"
    yield head("cancelled", "after, ms (median)", *(name.format(times=times) for name in longest))
    photo, disparity = scene(pixels)
    size = f"{photo.size[1]}x{photo.size[0]}"
    for quality in qualities:
        list(field(*scene(5_000), lambda: False, quality, GridShape(4, 3)))  # compiles
        waits = np.sort([wait_ms(photo, disparity, quality, k / times) for k in range(times)])
        watch = Watch()
        for _ in field(photo, disparity, watch, quality, WATCHED_GRID):
            watch()
        said = f"{np.median(waits):.0f}", f"{waits[-1]:.0f}", (waits > MOST_MS).sum(), watch.in_words()
        yield row(f"{quality}, {size}", *said)
    for name, work in depth_work(photo, disparity).items():
        work(lambda: False)
        watch = Watch()
        watch()
        work(watch)
        watch()
        yield row(f"{name}, {size}", "", "", "", watch.in_words())


def scene(pixels: int) -> tuple[Photo, Disparity]:
    """Noise, and blocks at nine depths: many depth edges."""
    random, width = np.random.default_rng(0), round((pixels * 4 / 3) ** 0.5)
    height = pixels // width
    blocks = np.kron(random.integers(-4, 5, (12, 16)), np.ones((-(-height // 12), -(-width // 16))))
    colors = random.uniform(0, 1, (height, width, 3)).astype(np.float32)
    return Photo(colors, 1000.0, "blocks"), Disparity(blocks[:height, :width].astype(np.float32), "blocks")


def field(
    photo: Photo, disparity: Disparity, should_stop: ShouldStop, quality: Quality, grid: GridShape = GRID
) -> Iterator[ViewUpdate]:
    """The views of the whole field, so far as they are taken, as the window has them made."""
    plan = plan_literal(photo, disparity, grid)
    return generate(photo, disparity, plan, should_stop, quality=quality, draft_bytes=DRAFT_BYTES)


def depth_work(photo: Photo, disparity: Disparity) -> dict[str, Callable[[ShouldStop], object]]:
    """What is done to depth before there are views: soft edges with holes refined, depth guessed from the photo."""
    soft = np.lib.stride_tricks.sliding_window_view(disparity.values, BLUR_PX, axis=1).mean(axis=-1)
    soft = np.pad(soft, ((0, 0), (BLUR_PX // 2, BLUR_PX // 2)), mode="edge").astype(np.float32)
    soft[np.random.default_rng(0).random(soft.shape) < 0.1] = np.nan
    return {
        "refine": lambda should_stop: refine(photo.pixels, soft, should_stop=should_stop),
        "guess": lambda should_stop: estimate_from_cues(photo, should_stop),
    }


def wait_ms(photo: Photo, disparity: Disparity, quality: Quality, share: float) -> float:
    """Cancel at some moment of the first seconds; how long until the generator ends."""
    stop, cancelled_at = threading.Event(), []

    def cancel() -> None:
        cancelled_at.append(time.perf_counter())
        stop.set()

    views = field(photo, disparity, stop.is_set, quality)
    timer = threading.Timer(0.05 + LAST_S * share, cancel)
    timer.start()
    for _ in views:
        pass
    end = time.perf_counter()
    timer.join()
    return 1e3 * (end - cancelled_at[0]) if cancelled_at and end > cancelled_at[0] else 0.0


def _asker() -> str:
    """Who asks whether to stop: a function of the core, or a thread about to begin its next band."""
    frame = sys._getframe(2)
    while frame.f_back and (frame.f_code.co_filename.endswith("tiling.py") or frame.f_code.co_name == "_should_stop"):
        frame = frame.f_back
    is_of_core = "iibr_core" in frame.f_code.co_filename
    return f"{frame.f_code.co_name}:{frame.f_lineno}" if is_of_core else "the next band of a thread"


if __name__ == "__main__":
    start("benchmarks.cancel", main)
