"""Views on their way from what makes them to a light field on disk."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING

from iibr_core.types import GridShape, ImageSize, ViewUpdate

if TYPE_CHECKING:
    from iibr_core.formats.light_fields.registry import LightFieldWriter


def write_views(
    views: Iterator[ViewUpdate], writer: LightFieldWriter, grid: GridShape, size: ImageSize, show: Callable[..., None]
) -> str:
    """Write all views of a grid, each of this (height, width); says, for people, how long making them took."""
    total, seconds = grid.rows * grid.columns, 0.0
    for done in range(1, total + 1):
        start = time.perf_counter()
        update = next(views)
        seconds += time.perf_counter() - start
        writer.add(update)
        show(done, total)
    return f"{total} views of {size} in {seconds:.2f} s ({1000 * seconds / total:.1f} ms per view)"
