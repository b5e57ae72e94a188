"""One view from the ray set: candidates, weights, colours, occlusion mask, fill. Row bands, or views, side by side."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import replace
from itertools import islice
from types import TracebackType
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.inpainting.background import fill_background, goes_on_in_front
from iibr_core.inpainting.inpainter import Inpainter
from iibr_core.rendering.ambiguous_rays import HYPOTHESES, SEARCH_PX, UndecidedRays, find_undecided_rays
from iibr_core.rendering.candidates import find_candidates
from iibr_core.rendering.hypotheses import AmbiguousRays, blend_hypotheses, describe_rays
from iibr_core.rendering.ray_set import RaySet
from iibr_core.rendering.rendered_view import DecidedRays, RaysBehind, RenderedView
from iibr_core.rendering.resampling import resample_colors
from iibr_core.rendering.visibility_weights import (
    LEAST_COVERED,
    MOSTLY_COVERED,
    WHOLLY_COVERED,
    entropy,
    weights_and_coverage,
)
from iibr_core.runtime import tiling
from iibr_core.runtime.kernels import kernel
from iibr_core.runtime.tiling import in_bands
from iibr_core.runtime.work import in_this_job, raise_if_stopped
from iibr_core.types import FloatImage, ViewOffset

EVERY_COST = 8
"""How many times as long a band takes where the transformer is asked for every ray."""

Item = TypeVar("Item")
Result = TypeVar("Result")


class ViewSynthesis:
    """Renders views on all cores; a context manager. Results do not depend on the number of threads or bands."""

    def __init__(
        self,
        transformer: Callable[[AmbiguousRays], FloatImage] | None = None,
        every: bool = False,
        slots: int = 5,
        keeps_entropy: bool = False,
        hypotheses: int = HYPOTHESES,
        inpainter: Inpainter = fill_background,
        reopens_holes: bool = False,
    ) -> None:
        """transformer: gives the weights (N, K) of ambiguous rays; None: closed form. every: of all rays.

        slots: candidates kept a ray. keeps_entropy: whether views bring the entropy of their weights. hypotheses: the
        transformer's K. inpainter: fills what no source shows. reopens_holes: and where only what was inpainted behind
        one of the photo's surfaces shows through a hole in that surface.
        """
        self._is_over = False
        self._transformer, self._every = transformer, every
        self._slots, self._hypotheses, self._keeps_entropy = slots, hypotheses, keeps_entropy
        self._inpainter, self._reopens_holes = inpainter, reopens_holes
        self._threads = ThreadPoolExecutor(tiling.THREADS, thread_name_prefix="iibr-views")

    def __enter__(self) -> ViewSynthesis:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Wait for the threads; views under way stop at their next band."""
        self._is_over = True
        self._threads.shutdown(cancel_futures=True)

    def add_rays(self, rays: RaySet, offset: ViewOffset, view: RenderedView) -> None:
        """See `Renderer`, as for all that follow."""
        if view.has_filled_rays:
            rays.add(offset, view.colors, view.disparity, view.occluded, view.behind)

    def render(self, rays: RaySet, offset: ViewOffset, alone: bool = False) -> RenderedView:
        """Row bands run side by side; alone, one after the other: the way for many views."""

        def decide(undecided: UndecidedRays) -> DecidedRays:
            return self.decide(rays, undecided)

        threads = 1 if alone else tiling.THREADS
        view, covered, decided = self._closed_form(rays, offset, decide, threads)
        view = self._fill(rays, offset, view, covered, threads)
        for part in decided:
            at = np.unravel_index(part.pixel, rays.view_size)
            view.colors[at], view.disparity[at], view.inpainted[at] = part.colors, part.disparity, part.inpainted
        return view

    def draft(self, rays: RaySet, offset: ViewOffset) -> tuple[RenderedView, list[UndecidedRays]]:
        """Of the undecided rays each band makes a part."""
        view, covered, undecided = self._closed_form(rays, offset, lambda part: part)
        return self._fill(rays, offset, view, covered, 1), [part for part in undecided if len(part.pixel)]

    def seen(self, rays: RaySet, offset: ViewOffset) -> tuple[RenderedView, FloatImage]:
        """Nothing is filled or decided."""
        return self._closed_form(rays, offset, lambda part: part)[:2]

    def decide(self, rays: RaySet, undecided: UndecidedRays) -> DecidedRays:
        """By the transformer's weights alone."""
        assert self._transformer is not None
        raise_if_stopped()
        ambiguous = describe_rays(rays, undecided)
        raise_if_stopped()
        chosen = self._transformer(ambiguous)
        raise_if_stopped()
        colors, disparity, source = blend_hypotheses(rays, ambiguous, chosen)
        y, x = np.divmod(undecided.pixel, rays.size.width)
        pixel = (y - rays.margins.top) * rays.view_size.width + x - rays.margins.left
        inpainted = source >= rays.photo_images
        inpainted |= _outside_frame(pixel.astype(np.int64), disparity, *undecided.offset, *rays.view_size)
        return DecidedRays(pixel, colors, disparity, inpainted)

    def side_by_side(self, work: Callable[[Item], Result], items: Iterable[Item]) -> Iterator[Result]:
        """As many at a time as there are threads."""
        items, running = iter(items), deque[Future[Result]]()
        work = in_this_job(work, or_when=lambda: self._is_over)
        while True:
            running.extend(self._threads.submit(work, item) for item in islice(items, tiling.THREADS - len(running)))
            if not running:
                return
            raise_if_stopped()
            yield running.popleft().result()

    def _closed_form(
        self,
        rays: RaySet,
        offset: ViewOffset,
        use: Callable[[UndecidedRays], Result],
        threads: int = 1,
    ) -> tuple[RenderedView, FloatImage, list[Result]]:
        """The view in closed form, its holes open; how much of each ray is covered (H, W); and of what bands leave to
        the transformer, what `use` makes in its band.
        """
        if not np.isfinite(offset).all():
            raise ValueError(f"view offset {tuple(offset)}: give finite numbers")
        view, covered = RenderedView.blank(rays.view_size, self._keeps_entropy), np.empty(rays.view_size, np.float32)

        def band(first: int, last: int) -> list[Result]:
            undecided = self._render_rows(rays, offset, (first, last), view, covered)
            return [use(undecided)] if undecided is not None else []

        made = in_bands(band, rays.view_size, threads, self._most_band_pixels)
        return view, covered, [part for parts in made for part in parts]

    def _fill(
        self, rays: RaySet, offset: ViewOffset, view: RenderedView, covered: FloatImage, threads: int
    ) -> RenderedView:
        """The view with its holes filled. covered (H, W): how much of each ray is covered: what covers a ray in part
        comes over what was filled there. So no pixel that two surfaces share is a seed for what is filled, either.
        """
        colors, disparity = view.colors.reshape(-1, 3), view.disparity.reshape(-1)
        part = np.flatnonzero((covered < _whole(rays)) & (covered > 0))
        part = part[_is_within_margins(rays, part, disparity[part], offset) | view.occluded.reshape(-1)[part]]
        hole = view.occluded.copy()
        hole.reshape(-1)[part] = True
        if self._reopens_holes and rays.stages.reopen_holes:
            hole |= self._reopened(rays, offset, view, hole, threads)
        if not hole.any():
            return view
        foreground, foreground_disparity = colors[part], disparity[part]
        self._inpainter(view.colors, view.disparity, hole, rays.photo_disparity, offset, threads)
        if not len(part):
            return view
        behind, share = RaysBehind(part, colors[part], disparity[part]), covered.reshape(-1)[part]
        colors[part] = _composite(foreground, behind.colors, share)
        disparity[part] = np.where(share > MOSTLY_COVERED, foreground_disparity, behind.disparity)
        return replace(view, behind=behind)

    def _reopened(
        self, rays: RaySet, offset: ViewOffset, view: RenderedView, hole: NDArray[np.bool_], threads: int
    ) -> NDArray[np.bool_]:
        """Where another view's filling shows, (H, W), but the photo's surfaces go on in front of it: there, that view
        saw what lies farther back. They count as occluded from now on.
        """
        pixel, filled = np.flatnonzero(view.inpainted & ~hole), np.zeros_like(hole)
        disparity = view.disparity.reshape(-1)[pixel]
        filled.reshape(-1)[pixel] = ~_outside_frame(pixel, disparity, *offset, *rays.view_size)
        if filled.any():
            filled &= goes_on_in_front(view.disparity, hole | filled, rays.photo_disparity, offset, threads)
            view.occluded[filled] = True
        return filled

    @property
    def _most_band_pixels(self) -> int:
        return tiling.MOST_BAND_PIXELS // (EVERY_COST if self._every else 1)

    def _render_rows(
        self,
        rays: RaySet,
        offset: ViewOffset,
        rows: tuple[int, int],
        view: RenderedView,
        covered: FloatImage,
    ) -> UndecidedRays | None:
        """Write rows [first, last) of the view in closed form, holes not filled yet, and of how much of each ray is
        covered; the rays that are the transformer's to decide, if there is one.
        """
        around = SEARCH_PX if self._transformer else 0
        # The images are larger than the view: their rows and columns count here.
        first, last = rows[0] + rays.margins.top, rows[1] + rays.margins.top
        left, right = rays.margins.left, rays.size.width - rays.margins.right
        above = min(first, around)
        seen = first - above, min(last + around, rays.size.height)
        columns = max(left - around, 0), min(right + around, rays.size.width)
        candidates = find_candidates(rays, offset, seen, self._slots, columns)
        raise_if_stopped()
        weights, share = weights_and_coverage(candidates)
        occluded = share < LEAST_COVERED
        inner = slice(above, above + last - first), slice(left, right)
        raise_if_stopped()
        shown = slice(*rows)
        wanted = np.zeros(occluded.shape, np.bool_)
        wanted[inner] = True
        found = resample_colors(rays, candidates, weights, wanted, (view.colors[shown], above, left))
        raise_if_stopped()
        undecided = None
        if self._transformer:
            decided = share < _whole(rays)
            decided[:, :left] = decided[:, right:] = True
            undecided = find_undecided_rays(
                rays, candidates, weights, found, (above, above + last - first), self._every, self._hypotheses, decided
            )
        view.disparity[shown] = found.disparity[inner]
        view.occluded[shown], covered[shown] = occluded[inner], share[inner]
        view.inpainted[shown] = occluded[inner] | (found.source[inner] >= rays.photo_images)
        if any(rays.margins):
            _mark_outside_frame(
                view.disparity[shown], rows[0], *map(float, offset), rays.view_size.height, view.inpainted[shown]
            )
        if view.entropy is not None:
            view.entropy[shown] = entropy(weights)[inner]
        return undecided


def _whole(rays: RaySet) -> float:
    """Rays covered less show in part what lies behind them."""
    return WHOLLY_COVERED if rays.stages.composite_partial_coverage else 0.0


def _is_within_margins(
    rays: RaySet, pixel: NDArray[np.int64], disparity: FloatImage, offset: ViewOffset
) -> NDArray[np.bool_]:
    """Which of these pixels (N) of a view look between the centres of the outermost rays."""
    y, x = np.divmod(pixel, rays.view_size.width)
    y, x = y + rays.margins.top + disparity * offset.t, x + rays.margins.left + disparity * offset.s
    return np.asarray((y >= 0) & (y <= rays.size.height - 1) & (x >= 0) & (x <= rays.size.width - 1))


@kernel
def _outside_frame(pixel, disparity, t, s, height, width):
    """Which rays (N) of a view look beyond the photo's frame. pixel: indices into a view's pixels, row by row."""
    beyond = np.empty(len(pixel), np.bool_)
    for i in range(len(pixel)):
        v, u = pixel[i] // width + disparity[i] * t, pixel[i] % width + disparity[i] * s
        beyond[i] = _is_outside(v, u, height, width)
    return beyond


@kernel
def _mark_outside_frame(disparity, first_row, t, s, height, inpainted):
    """The same for rows of a view, from first_row on: marked in inpainted (N, W)."""
    rows, width = disparity.shape
    for row in range(rows):
        for x in range(width):
            v, u = first_row + row + disparity[row, x] * t, x + disparity[row, x] * s
            inpainted[row, x] |= _is_outside(v, u, height, width)


@kernel
def _is_outside(v, u, height, width):
    # Without branches: rows are compared many at a time.
    return (v < -0.5) | (v > height - 0.5) | (u < -0.5) | (u > width - 0.5)


def _composite(foreground: FloatImage, background: FloatImage, share: FloatImage) -> FloatImage:
    """Colours (N, 3) of a foreground that covers these shares (N) of its pixels, over a background, in linear light."""
    light = linear_from_srgb(background) + share[:, None] * (
        linear_from_srgb(foreground) - linear_from_srgb(background)
    )
    return np.asarray(srgb_from_linear(light), np.float32)
