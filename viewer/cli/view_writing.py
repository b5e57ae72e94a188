"""Write views to a light field on disk and measure how long making them took."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from iibr_core.runtime.work import report_progress
from iibr_core.scenes.scene import MAKING
from iibr_core.types import ImageSize, ViewUpdate


def write_views(
    views: Iterator[ViewUpdate], write: Callable[[Iterator[ViewUpdate]], None], size: ImageSize, total: int
) -> str:
    """Write views and return a sentence about their number, their size and the time that making them took.

    write: writes all views. total: their number.
    """
    count, seconds = 0, 0.0

    def timed() -> Iterator[ViewUpdate]:
        nonlocal count, seconds
        start = time.perf_counter()
        for view in views:
            seconds += time.perf_counter() - start
            count += 1
            yield view
            report_progress(count, total, MAKING)
            start = time.perf_counter()

    write(timed())
    return f"{count} views of {size} in {seconds:.2f} s ({1000 * seconds / max(count, 1):.1f} ms per view)"
