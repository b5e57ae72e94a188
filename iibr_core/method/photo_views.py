"""Views at any viewpoints around a photo, made as `generate` makes those of a grid."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import partial

from iibr_core.inpainting.background import fill_background
from iibr_core.method.farthest_views import farthest_views, outer_views, outpainting_margins
from iibr_core.method.ray_transformer import shipped_transformer
from iibr_core.method.rays import NO_MARGINS, rays_of_photo
from iibr_core.method.update_loop import update
from iibr_core.method.view import Renderer, View, finish
from iibr_core.runtime.tiling import THREADS, side_by_side
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.types import FloatImage, ViewOffset


class PhotoViews:
    """Views of one photo with one disparity map, from one ray set. outer: viewpoints that complete the ray set."""

    def __init__(
        self, photo: FloatImage, disparity: FloatImage, offsets: Iterable[ViewOffset], stages: Stages = ALL_STAGES
    ) -> None:
        """Make the ray set.

        photo (H, W, 3): sRGB-encoded. disparity (H, W): in px per view step. offsets: all that will be asked for.
        stages: that are on. Raises InputError if the transformer's weights cannot be read.
        """
        self.outer = outer_views(offsets)
        margins = outpainting_margins(disparity, self.outer) if stages.outpainting else NO_MARGINS
        self.rays = rays_of_photo(photo, disparity, farthest_views(self.outer), len(self.outer), margins, stages)
        transformer = shipped_transformer() if stages.ray_transformer else None
        self._renderer = Renderer(transformer, partial(fill_background, stages=stages))
        shared = self.outer if stages.share_inpainted else ()
        made = update(self.rays, shared, self._renderer)
        self._outer_views = {offset: finish(self.rays, offset, view, None) for offset, view in made}

    def view(self, offset: ViewOffset, threads: int = THREADS) -> View:
        """Return the view at an offset. threads: number of row bands side by side."""
        if offset in self._outer_views:
            return self._outer_views[offset]
        return finish(self.rays, offset, self._renderer.render(self.rays, offset, threads), threads)

    def views(self, offsets: Iterable[ViewOffset]) -> Iterator[View]:
        """Yield the views at these offsets, in their order, several at a time."""
        return side_by_side(lambda offset: self.view(offset, 1), offsets)
