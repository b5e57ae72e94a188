"""Photo + disparity -> the views of a light field, one after the other: sections 3.3 and 3.4 of the paper.

The farthest views come first and complete the ray set; the others may come in any order, and between those of a grid.
Every view is made once.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterable, Iterator
from contextlib import suppress
from functools import cached_property, partial
from threading import Lock

import numpy as np

from iibr_core.color import stored_from_encoded
from iibr_core.inpainting.background import fill_background
from iibr_core.inpainting.registry import DEFAULT_INPAINTER, EstimateDepth, Inpainter, load_inpainter, require_inpainter
from iibr_core.method.farthest_views import farthest_views, outer_views, outer_views_of_grid, outpainting_margins
from iibr_core.method.plan import ScenePlan
from iibr_core.method.ray_transformer import shipped_transformer
from iibr_core.method.rays import NO_MARGINS, RaySet, rays_of_photo
from iibr_core.method.update_loop import update
from iibr_core.method.view import Renderer, View, finish, finished_colors
from iibr_core.runtime.tiling import THREADS, in_bands, side_by_side
from iibr_core.runtime.work import Cancelled
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.types import (
    CENTRE,
    Disparity,
    FloatImage,
    GridShape,
    Photo,
    StoredColors,
    ViewOffset,
    ViewUpdate,
    image_size,
)


class ViewMaker:
    """Makes views of one photo with one disparity map, all from one ray set.

    The ray set is made and completed when it is first needed. outer: viewpoints that complete it.
    """

    def __init__(
        self,
        photo: FloatImage,
        disparity: FloatImage,
        offsets: Iterable[ViewOffset],
        load: Callable[[], Inpainter] | None = None,
        stages: Stages = ALL_STAGES,
        has_disocclusion: bool = True,
    ) -> None:
        """Keep what views are made of.

        photo (H, W, 3): sRGB-encoded. disparity (H, W): in px per view step. offsets: all that will be asked for, or
        the corners of their box. load: returns the inpainter when the first view is made, None for the background's.
        stages: that are on. has_disocclusion: False if no view shows what the photo does not.
        """
        self._photo, self._disparity, self._stages = photo, disparity, stages
        self._load = load or (lambda: partial(fill_background, stages=stages))
        corners = outer_views(offsets)
        self._farthest, self.outer = farthest_views(corners), corners if has_disocclusion else []
        self._rays: RaySet | None = None
        self._outer_views: dict[ViewOffset, View] = {}
        self._lock = Lock()

    @property
    def rays(self) -> RaySet:
        """The complete ray set. Raises InputError if the transformer's weights or the inpainter cannot be read."""
        with self._lock:
            if self._rays is None:
                self._outer_views = {offset: view for _, offset, view in self._complete()}
            assert self._rays is not None
            return self._rays

    def view(self, offset: ViewOffset, threads: int = THREADS) -> View:
        """Return the view at an offset. threads: number of row bands side by side."""
        rays = self.rays
        view = self._outer_views.get(offset) or self._renderer.render(rays, offset, threads)
        return finish(rays, offset, view, threads)

    def generate(
        self,
        grid: GridShape,
        is_hdr: bool = False,
        nearest_to: Callable[[], ViewOffset] = lambda: CENTRE,
        wanted: Callable[[], Collection[ViewOffset] | None] = lambda: None,
    ) -> Generator[ViewUpdate]:
        """Yield every view of a grid once, in the form of storage: the photo's, the farthest, then those nearest to
        `nearest_to()`.

        wanted: called once, after the photo's view was taken; returns the offsets of the views to make, None for all.
        Pixels do not depend on the order of the views. The generator ends once the job is stopped.
        """
        with suppress(Cancelled):
            nothing = np.zeros(image_size(self._photo), np.bool_)
            yield ViewUpdate(*grid.centre, encode_for_storage(self._photo, is_hdr), self._disparity, nothing)
            chosen = wanted()
            views = [grid.offset(v, u) for v, u in np.ndindex(*grid) if (v, u) != grid.centre]
            views = [at for at in views if chosen is None or at in chosen]
            if not views:
                return

            def stored(rays: RaySet, offset: ViewOffset, view: View) -> ViewUpdate:
                colors = finished_colors(rays, offset, view, encode_for_storage(view.colors, is_hdr, 1))
                return ViewUpdate(*grid.index_of(offset), colors, view.disparity, view.inpainted)

            for rays, offset, view in self._complete():
                if offset in views:
                    views.remove(offset)
                    yield stored(rays, offset, view)
            rays = self.rays
            yield from side_by_side(
                lambda offset: stored(rays, offset, self._renderer.render(rays, offset)),
                nearest_first(views, nearest_to),
            )

    @cached_property
    def _renderer(self) -> Renderer:
        return Renderer(shipped_transformer() if self._stages.ray_transformer else None, self._load())

    def _complete(self) -> Iterator[tuple[RaySet, ViewOffset, View]]:
        """Make the ray set and yield it with each outer view, not finished, whose inpainted pixels have joined it."""
        stages, outer = self._stages, self.outer
        margins = outpainting_margins(self._disparity, outer) if stages.outpainting else NO_MARGINS
        rays = rays_of_photo(self._photo, self._disparity, self._farthest, len(outer), margins, stages)
        for offset, view in update(rays, outer if stages.share_inpainted else (), self._renderer):
            yield rays, offset, view
        self._rays = rays


def view_maker(
    photo: Photo,
    disparity: Disparity,
    plan: ScenePlan,
    inpaint: str = DEFAULT_INPAINTER,
    estimate_depth: EstimateDepth | None = None,
    stages: Stages = ALL_STAGES,
) -> ViewMaker:
    """Return the maker of the views of `plan.grid` and between them.

    disparity: the field's (`plan.field_disparity(given)`). inpaint, estimate_depth: see `load_inpainter`. Raises
    InputError if there is no such way of inpainting.
    """
    require_inpainter(inpaint)
    # A model is not loaded for nothing.
    load = partial(load_inpainter, inpaint if plan.has_disocclusion else DEFAULT_INPAINTER, estimate_depth)
    outer = outer_views_of_grid(plan.grid)
    return ViewMaker(photo.pixels, disparity.values, outer, load, stages, plan.has_disocclusion)


def encode_for_storage(encoded: FloatImage, is_hdr: bool, threads: int | None = None) -> StoredColors:
    """Return `stored_from_encoded` of an image (H, W, 3), in bands. threads: None for all cores."""
    stored = np.empty(encoded.shape, np.float16 if is_hdr else np.uint8)

    def band(first: int, last: int) -> None:
        stored[first:last] = stored_from_encoded(encoded[first:last], is_hdr)

    in_bands(band, image_size(encoded), threads)
    return stored


def nearest_first(remaining: list[ViewOffset], nearest_to: Callable[[], ViewOffset]) -> Iterator[ViewOffset]:
    """Yield each time the view nearest to where the user looks then, the first of equals. The list is used up."""
    while remaining:
        eye = nearest_to()
        nearest = min(remaining, key=lambda at: (at.t - eye.t) ** 2 + (at.s - eye.s) ** 2)
        remaining.remove(nearest)
        yield nearest
