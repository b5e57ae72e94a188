"""Views on their way from what makes them to a light field on disk."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from iibr_core.types import GridShape, ImageSize, ViewUpdate

if TYPE_CHECKING:
    from iibr_core.formats.light_fields.light_field_formats import LightFieldWriter


def write_views(
    views: Iterator[ViewUpdate],
    writer: LightFieldWriter,
    grid: GridShape,
    size: ImageSize,
    report_share: Callable[[float], None],
) -> str:
    """Write all views of a grid, each of this (height, width); says, for people, how long making them took.

    report_share: is told the share of the work that is done.
    """
    total, seconds = grid.rows * grid.columns, 0.0
    for _ in range(total):
        start = time.perf_counter()
        update = next(views)
        seconds += time.perf_counter() - start
        writer.add(update)
        report_share(update.share)
    return f"{total} views of {size} in {seconds:.2f} s ({1000 * seconds / total:.1f} ms per view)"
