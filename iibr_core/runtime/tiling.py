"""Long work in short pieces: bands of rows of an image, one after the other or side by side.

Between two pieces it can be cancelled; results do not depend on how many there are.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from typing import TypeVar

from iibr_core.runtime.machine import core_count
from iibr_core.types import ImageSize

ShouldStop = Callable[[], bool]

MOST_BAND_PIXELS = 1 << 17
"""Largest number of pixels in a band: a cancelled job stops within some 30 ms."""
THREADS = core_count()

Item = TypeVar("Item")
Result = TypeVar("Result")


class Cancelled(Exception):
    """The caller's should_stop became true."""


def never() -> bool:
    """Return False: the should_stop of work that is never cancelled."""
    return False


def raise_if_stopped(should_stop: ShouldStop) -> None:
    """Raise Cancelled once should_stop is true."""
    if should_stop():
        raise Cancelled


def pieces_of(count: int, most: int) -> list[slice]:
    """Slices that part so many things into pieces of `most`, the last of which may be shorter."""
    return [slice(first, first + most) for first in range(0, count, most)]


def in_pieces(
    work: Callable[[Item], Result], items: Sequence[Item], should_stop: ShouldStop = never, threads: int = 1
) -> list[Result]:
    """The results of work on all items, in their order. threads: so many items side by side.

    Raises Cancelled once should_stop is true, which is asked before every item.
    """

    def piece(item: Item) -> Result:
        raise_if_stopped(should_stop)
        return work(item)

    raise_if_stopped(should_stop)
    if min(threads, len(items)) <= 1:
        return list(map(piece, items))
    with ThreadPoolExecutor(min(threads, len(items)), thread_name_prefix="iibr-bands") as pool:
        return list(pool.map(piece, items))


def in_bands(
    work: Callable[[int, int], Result],
    size: ImageSize,
    should_stop: ShouldStop = never,
    threads: int | None = None,
    most_pixels: int | None = None,
) -> list[Result]:
    """The results of work(first, last) on all rows [first, last) of an image (height, width), band after band.

    threads: so many bands side by side, all cores by default. most_pixels: of a band, MOST_BAND_PIXELS by default.
    Raises Cancelled once should_stop is true.
    """
    height, width = size
    threads = threads or THREADS
    # Short enough to stop soon, and at least one band for each thread.
    rows = max(min((most_pixels or MOST_BAND_PIXELS) // max(width, 1), -(-height // threads)), 1)
    firsts = range(0, height, rows)
    return in_pieces(lambda first: work(first, min(first + rows, height)), firsts, should_stop, threads)
