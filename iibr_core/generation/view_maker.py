"""Views at any viewpoints around a given photo, made as `generate` makes a grid's: what evaluation judges."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from functools import partial
from types import TracebackType

from iibr_core.color import encoded_from_stored, stored_from_encoded
from iibr_core.generation.light_field import transformer_for
from iibr_core.generation.outer_views import farthest_views, outer_views, outpainting_margins
from iibr_core.generation.update_loop import render_outer_views
from iibr_core.inpainting.background import fill_background
from iibr_core.rendering.ambiguous_rays import HYPOTHESES
from iibr_core.rendering.flying_pixels import postprocessed_view
from iibr_core.rendering.photo_rays import rays_of_photo
from iibr_core.rendering.ray_set import NO_MARGINS
from iibr_core.rendering.rendered_view import RenderedView
from iibr_core.rendering.renderer import Renderer, open_renderer
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.types import FloatImage, Quality, ViewOffset


class ViewMaker:
    """Makes views of one photo with one disparity map, in several qualities from one ray set; a context manager.

    Raises InputError where the trained weights cannot be read.
    """

    def __init__(
        self,
        photo: FloatImage,
        disparity: FloatImage,
        offsets: Iterable[ViewOffset],
        qualities: Iterable[Quality],
        slots: int = 5,
        hypotheses: int = HYPOTHESES,
        every: bool = False,
        stages: Stages = ALL_STAGES,
    ) -> None:
        """photo: (H, W, 3) sRGB-encoded. disparity: (H, W), px per view step. offsets: all that will be asked for.

        slots, hypotheses, every: see ViewSynthesis. stages: that are on.
        """
        self._slots = slots
        self.outer = outer_views(offsets)
        margins = outpainting_margins(disparity, self.outer) if stages.outpainting else NO_MARGINS
        farthest = farthest_views(self.outer)
        self._rays = rays_of_photo(photo, disparity, farthest, len(self.outer), margins, stages)
        self._inpainter = partial(fill_background, stages=stages)
        self._first: dict[ViewOffset, tuple[RenderedView, float]] = {}
        self._renderers: dict[Quality, Renderer] = {
            quality: open_renderer(
                transformer_for(quality) if stages.ray_transformer else None,
                every,
                slots,
                hypotheses=hypotheses,
                inpainter=self._inpainter,
            )
            for quality in qualities
        }

    def __enter__(self) -> ViewMaker:
        """Complete the ray set by what the outer views disocclude."""
        try:
            start = time.perf_counter()
            shared = self.outer if self._rays.stages.share_inpainted else ()
            for offset, view in render_outer_views(self._rays, shared, self._inpainter, self._slots):
                self._first[offset] = self._postprocessed(offset, view), 1e3 * (time.perf_counter() - start)
                start = time.perf_counter()
        except BaseException:
            self.__exit__(None, None, None)
            raise
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        for renderer in self._renderers.values():
            renderer.__exit__(kind, error, trace)

    def view(self, quality: Quality, offset: ViewOffset) -> RenderedView:
        """The view at an offset; of fast quality the outer ones are those that completed the ray set."""
        return self.timed_view(quality, offset)[0]

    def timed_view(self, quality: Quality, offset: ViewOffset) -> tuple[RenderedView, float]:
        """The same, and the milliseconds it took on all cores."""
        if quality == "fast" and offset in self._first:
            return self._first[offset]
        start = time.perf_counter()
        view = self._postprocessed(offset, self._renderers[quality].render(self._rays, offset))
        return view, 1e3 * (time.perf_counter() - start)

    def views(self, quality: Quality, offsets: Iterable[ViewOffset]) -> Iterator[RenderedView]:
        """Views at these offsets, in their order, several at a time, as `generate` makes them."""
        renderer = self._renderers[quality]
        return renderer.side_by_side(
            lambda offset: self._postprocessed(offset, renderer.render(self._rays, offset, alone=True), 1), offsets
        )

    def _postprocessed(self, offset: ViewOffset, view: RenderedView, threads: int | None = None) -> RenderedView:
        return postprocessed_view(self._rays, offset, view, threads)


def quantise_as_stored(colors: FloatImage) -> FloatImage:
    """Colours as the light field keeps them: rounded to bytes, 1 = white."""
    return encoded_from_stored(stored_from_encoded(colors, False))
