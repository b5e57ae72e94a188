"""Run a function on bands of rows, or on items, one after the other or in threads; the job can be cancelled between.

Results do not depend on the number of bands.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ThreadPoolExecutor, wait
from itertools import islice
from typing import TypeVar

from iibr_core.runtime.machine import core_count
from iibr_core.runtime.work import in_this_job, raise_if_stopped
from iibr_core.types import ImageSize

MAX_PIXELS_AT_ONCE = 1 << 17
"""Largest number of pixels in a band: a cancelled job stops within some 30 ms."""
THREADS = core_count()
_POOL = ThreadPoolExecutor(THREADS, thread_name_prefix="iibr-bands")
"""Threads that help with the pieces of all jobs; they start when they are needed."""

Item = TypeVar("Item")
Result = TypeVar("Result")


def pieces_of(count: int, most: int) -> list[slice]:
    """Return slices that split `count` items into pieces of `most`; the last piece may be shorter."""
    return [slice(first, first + most) for first in range(0, count, most)]


def in_pieces(work: Callable[[Item], Result], items: Sequence[Item], threads: int = 1) -> list[Result]:
    """Return the results of work on all items, in their order. threads: number of items side by side.

    The calling thread works, too, and waits only for pieces that have begun, so calls may be nested. Raises Cancelled
    once the job is stopped, which is asked before every item.
    """
    raise_if_stopped()
    results: dict[int, Result] = {}
    waiting = iter(range(len(items)))

    def take_pieces() -> None:
        try:
            for number in waiting:
                raise_if_stopped()
                results[number] = work(items[number])
        except BaseException:
            deque(waiting, 0)  # no other thread begins a piece
            raise

    helpers = [_POOL.submit(in_this_job(take_pieces)) for _ in range(min(threads, len(items)) - 1)]
    try:
        take_pieces()
    finally:
        begun = [helper for helper in helpers if not helper.cancel()]
        wait(begun)
    for helper in begun:
        helper.result()
    return [results[number] for number in range(len(items))]


def in_bands(
    work: Callable[[int, int], Result],
    size: ImageSize,
    threads: int | None = None,
    most_pixels: int | None = None,
) -> list[Result]:
    """Return the results of work(first, last) on all rows [first, last) of an image (height, width), band by band.

    threads: number of bands side by side, all cores by default. most_pixels: of a band, MAX_PIXELS_AT_ONCE by default.
    Raises Cancelled once the job is stopped.
    """
    height, width = size
    threads = threads or THREADS
    # Short enough to stop soon, and at least one band for each thread.
    rows = max(min((most_pixels or MAX_PIXELS_AT_ONCE) // max(width, 1), -(-height // threads)), 1)
    firsts = range(0, height, rows)
    return in_pieces(lambda first: work(first, min(first + rows, height)), firsts, threads)


def side_by_side(work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
    """Yield the results of work on all items, in their order; each item is taken once a thread is free for it.

    Closing the generator stops the running calls. Raises Cancelled once the job is stopped.
    """
    is_closed = False
    run, items, running = in_this_job(work, or_when=lambda: is_closed), iter(items), deque[Future[Result]]()
    pool = ThreadPoolExecutor(THREADS, thread_name_prefix="iibr-views")
    try:
        while True:
            running.extend(pool.submit(run, item) for item in islice(items, THREADS - len(running)))
            if not running:
                return
            raise_if_stopped()
            yield running.popleft().result()
    finally:
        is_closed = True
        pool.shutdown(cancel_futures=True)
