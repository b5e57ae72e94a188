"""One view from the ray set: candidates, weights, colours, occlusion mask, fill. Row bands, or views, side by side."""

from __future__ import annotations

import os
from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass
from itertools import islice
from types import TracebackType
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from iibr_core.candidates import Candidates, find_candidates
from iibr_core.contested import HYPOTHESES, REACH_PX, Contested, decide, find_contested
from iibr_core.inpaint.background import fill_background
from iibr_core.lookup import OWN_SURFACE_PX, heaviest, look_up_colors
from iibr_core.mixed_pixels import split_mixed_pixels
from iibr_core.occlusion import entropy, occlusion_mask
from iibr_core.rays import RaySet
from iibr_core.types import FloatImage, ViewOffset
from iibr_core.weights import closed_form_weights

MOST_BAND_PIXELS = 1 << 17
"""Of a row band: a cancelled view stops after one, within some 30 ms."""
EDGE_PX = 2.0
"""A step of disparity is a depth edge if it opens a gap of at least this many pixels in the outermost view."""

THREADS = os.cpu_count() or 1

Item = TypeVar("Item")
Result = TypeVar("Result")


class Cancelled(Exception):
    """The caller's should_stop became true within a view."""


@dataclass(frozen=True, eq=False)
class RenderedView:
    """A view without holes.

    colors: (H, W, 3) sRGB-encoded. disparity: (H, W). occluded: (H, W), True where no source showed anything, so that
    it was filled here. inpainted: (H, W), True where the photo showed nothing: filled here or in an earlier view.
    entropy: (H, W) in [0, 1], of the closed form's weights, or None where it was not asked for.
    """

    colors: FloatImage
    disparity: FloatImage
    occluded: NDArray[np.bool_]
    inpainted: NDArray[np.bool_]
    entropy: FloatImage | None = None


def rays_of_photo(colors: FloatImage, disparity: FloatImage, farthest_views: float, more: int) -> RaySet:
    """The ray set of a photo: its own rays, and the fringe of its mixed pixels, with room for `more` images.

    farthest_views: the largest view offset that will be rendered; it decides which steps of disparity are depth edges.
    """
    centre = ViewOffset(0.0, 0.0)
    own, fringe, fringe_disparity, coverage = split_mixed_pixels(colors, disparity, EDGE_PX / farthest_views)
    rays = RaySet(2 + more, disparity.shape, OWN_SURFACE_PX / farthest_views, farthest_views)
    rays.add(centre, own, disparity, np.ones_like(disparity))
    if coverage.any():
        rays.add(centre, fringe, fringe_disparity, coverage)
    return rays


class ViewSynthesis:
    """Renders views on all cores; a context manager. Results do not depend on the number of threads or bands."""

    def __init__(
        self,
        should_stop: Callable[[], bool] = lambda: False,
        transformer: Callable[[Contested], FloatImage] | None = None,
        every: bool = False,
        slots: int = 5,
        keeps_entropy: bool = False,
        hypotheses: int = HYPOTHESES,
    ) -> None:
        """transformer: gives the weights (N, K) of contested rays; None: closed form. every: of all rays.

        slots: candidates kept a ray. keeps_entropy: whether views bring the entropy of their weights. hypotheses: the
        transformer's K.
        """
        self._should_stop = should_stop
        self._transformer, self._every = transformer, every
        self._slots, self._hypotheses, self._keeps_entropy = slots, hypotheses, keeps_entropy
        self._threads = ThreadPoolExecutor(THREADS, thread_name_prefix="iibr-rows")

    def __enter__(self) -> ViewSynthesis:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._threads.shutdown(cancel_futures=True)

    def render(self, rays: RaySet, offset: ViewOffset) -> RenderedView:
        """The view at an offset, its holes filled; row bands run side by side.

        Raises Cancelled once should_stop is true, ValueError for an offset that is not finite.
        """
        return self._filled(rays, offset, self._threads.map(self._band(rays, offset), self._rows(rays, THREADS)))

    def render_alone(self, rays: RaySet, offset: ViewOffset) -> RenderedView:
        """The same view, its row bands one after the other in the calling thread: the way for many views."""
        return self._filled(rays, offset, map(self._band(rays, offset), self._rows(rays, 1)))

    def side_by_side(self, work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """The results of work on all items, in their order. An item is only taken when a thread is free for it."""
        items, running = iter(items), deque[Future[Result]]()
        while True:
            running.extend(self._threads.submit(work, item) for item in islice(items, THREADS - len(running)))
            if not running:
                return
            if self._should_stop():
                raise Cancelled
            yield running.popleft().result()

    def _seen(self, rays: RaySet, offset: ViewOffset, rows: tuple[int, int]) -> tuple[NDArray[Any], ...]:
        """Colours, disparity, source and occlusion of rows [first, last) of the view, holes not filled yet; then the
        entropy if it is kept.
        """
        around = REACH_PX if self._transformer else 0
        above = min(rows[0], around)
        candidates = find_candidates(rays, offset, (rows[0] - above, min(rows[1] + around, rays.size[0])), self._slots)
        weights = closed_form_weights(candidates)
        occluded = occlusion_mask(weights)
        inner = slice(above, above + rows[1] - rows[0])
        if self._transformer:
            colors, disparity, source = self._decided(rays, candidates, weights, inner)
        else:
            colors, disparity, source = look_up_colors(rays, candidates, weights)
        kept = (entropy(weights)[inner],) if self._keeps_entropy else ()
        return colors[inner], disparity[inner], source[inner], occluded[inner], *kept

    def _decided(
        self, rays: RaySet, candidates: Candidates, weights: FloatImage, inner: slice
    ) -> tuple[FloatImage, FloatImage, NDArray[np.uint8]]:
        """What `look_up_colors` gives for the inner rows, but what contested rays show is the transformer's choice."""
        assert self._transformer is not None
        rows = inner.start, inner.stop
        shown = heaviest(candidates, weights)
        contested = find_contested(rays, candidates, weights, shown, rows, self._every, self._hypotheses)
        at = contested.pixel[:, 0] - candidates.first_row, contested.pixel[:, 1]
        wanted = np.zeros(candidates.count.shape, np.bool_)
        wanted[inner] = True
        wanted[at] = False
        colors, disparity, source = look_up_colors(rays, candidates, weights, wanted)
        colors[at], disparity[at], source[at] = decide(rays, contested, self._transformer(contested))
        return colors, disparity, source

    def _band(self, rays: RaySet, offset: ViewOffset) -> Callable[[tuple[int, int]], tuple[NDArray[Any], ...]]:
        """What renders rows [first, last) of this view."""
        if not np.isfinite(offset).all():
            raise ValueError(f"view offset {tuple(offset)}: give finite numbers")
        if self._transformer:
            rays.surroundings  # noqa: B018 - made before the threads ask for it

        def band(rows: tuple[int, int]) -> tuple[NDArray[Any], ...]:
            if self._should_stop():
                raise Cancelled
            return self._seen(rays, offset, rows)

        return band

    @staticmethod
    def _rows(rays: RaySet, least_bands: int) -> Iterator[tuple[int, int]]:
        height, width = rays.size
        rows = max(min(MOST_BAND_PIXELS // width, -(-height // least_bands)), 1)
        return ((first, min(first + rows, height)) for first in range(0, height, rows))

    @staticmethod
    def _filled(rays: RaySet, offset: ViewOffset, bands: Iterable[tuple[NDArray[Any], ...]]) -> RenderedView:
        colors, disparity, source, occluded, *entropies = (np.concatenate(part) for part in zip(*bands))
        if occluded.any():
            fill_background(colors, disparity, occluded, rays.photo_disparity, offset)
        inpainted = occluded | (source >= rays.photo_images)
        return RenderedView(colors, disparity, occluded, inpainted, entropies[0] if entropies else None)
