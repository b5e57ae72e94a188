"""Write views to a light field on disk and measure how long making them took."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator

from iibr_core.types import ImageSize, ViewUpdate


def write_views(
    views: Iterator[ViewUpdate],
    write: Callable[[Iterator[ViewUpdate]], None],
    size: ImageSize,
    report_share: Callable[[float], None],
) -> str:
    """Write views and return a sentence about their number, their size and the time that making them took.

    write: writes all views. report_share: called with the share of the work that is done, 0 to 1.
    """
    count, seconds = 0, 0.0

    def timed() -> Iterator[ViewUpdate]:
        nonlocal count, seconds
        start = time.perf_counter()
        for view in views:
            seconds += time.perf_counter() - start
            count += 1
            yield view
            report_share(view.share)
            start = time.perf_counter()

    write(timed())
    return f"{count} views of {size} in {seconds:.2f} s ({1000 * seconds / max(count, 1):.1f} ms per view)"
