"""How long a cancelled field goes on: from the word to the end of the generator, at 4 MP.

    python -m benchmarks.cancel [--pixels 4000000] [--times 20] [--quality fast balanced exact]

The word comes at random moments of generating. The viewer's worker then drops the job. Target: 100 ms. The machine's
load counts: the time that one row band of a view takes without being cancelled stands beside it.
"""

from __future__ import annotations

import argparse
import threading
import time

import numpy as np

from iibr_core.generate import generate
from iibr_core.plan import plan_literal
from iibr_core.types import Disparity, GridShape, Photo

GRID = GridShape(9, 9)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pixels", type=int, default=4_000_000)
    parser.add_argument("--times", type=int, default=20)
    parser.add_argument("--quality", nargs="+", default=["fast", "balanced"], choices=["fast", "balanced", "exact"])
    given = parser.parse_args()
    photo, disparity = scene(given.pixels)
    size = f"{photo.size[1]}x{photo.size[0]}"
    for quality in given.quality:
        compiled(quality)
        waits = np.sort([wait_ms(photo, disparity, quality, k / given.times) for k in range(given.times)])
        print(
            f"{quality:9} {size}: cancelled after {np.median(waits):.0f} ms (median), {waits[-1]:.0f} ms (longest of"
            f" {given.times}); over 100 ms: {(waits > 100).sum()}",
            flush=True,
        )


def scene(pixels: int) -> tuple[Photo, Disparity]:
    """Noise, and blocks at nine depths: many depth edges."""
    random, width = np.random.default_rng(0), round((pixels * 4 / 3) ** 0.5)
    height = pixels // width
    blocks = np.kron(random.integers(-4, 5, (12, 16)), np.ones((-(-height // 12), -(-width // 16))))
    colors = random.uniform(0, 1, (height, width, 3)).astype(np.float32)
    return Photo(colors, 1000.0, "blocks"), Disparity(blocks[:height, :width].astype(np.float32), "blocks")


def compiled(quality: str) -> None:
    """Everything that is needed, on a small photo."""
    photo, disparity = scene(5_000)
    list(generate(photo, disparity, plan_literal(photo, disparity, GridShape(3, 3)), quality=quality))  # type: ignore[arg-type]


def wait_ms(photo: Photo, disparity: Disparity, quality: str, share: float) -> float:
    """Cancel at some moment of the first seconds; how long until the generator ends."""
    plan = plan_literal(photo, disparity, GRID)
    stop, told = threading.Event(), []

    def cancel() -> None:
        told.append(time.perf_counter())
        stop.set()

    timer = threading.Timer(0.05 + 4 * share, cancel)
    timer.start()
    for _ in generate(photo, disparity, plan, stop.is_set, quality=quality):  # type: ignore[arg-type]
        pass
    end = time.perf_counter()
    timer.join()
    return 1e3 * (end - told[0]) if told and end > told[0] else 0.0


if __name__ == "__main__":
    main()
