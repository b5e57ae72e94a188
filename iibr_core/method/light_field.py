"""Photo + disparity -> the views of a light field, one after the other: sections 3.3 and 3.4 of the paper.

The farthest views come first and complete the ray set; the others may come in any order. Every view is made once.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Generator, Iterator, Sequence
from contextlib import suppress
from functools import partial

import numpy as np

from iibr_core.color import stored_from_encoded
from iibr_core.inpainting.registry import DEFAULT_INPAINTER, EstimateDepth, Inpainter, load_inpainter, require_inpainter
from iibr_core.method.farthest_views import farthest_views, outer_views_of_grid, outpainting_margins
from iibr_core.method.plan import ScenePlan
from iibr_core.method.ray_transformer import shipped_transformer
from iibr_core.method.rays import RaySet, rays_of_photo
from iibr_core.method.update_loop import update
from iibr_core.method.view import Renderer, View, finished_colors
from iibr_core.runtime.tiling import in_bands, side_by_side
from iibr_core.runtime.work import Cancelled
from iibr_core.types import (
    Disparity,
    FloatImage,
    GridShape,
    Photo,
    StoredColors,
    ViewOffset,
    ViewUpdate,
    image_size,
)


def generate(
    photo: Photo,
    disparity: Disparity,
    plan: ScenePlan,
    nearest_to: Callable[[], ViewOffset] = lambda: ViewOffset(0.0, 0.0),
    inpaint: str = DEFAULT_INPAINTER,
    estimate_depth: EstimateDepth | None = None,
    wanted: Callable[[], Collection[ViewOffset] | None] = lambda: None,
) -> Generator[ViewUpdate]:
    """Yield every view of `plan.grid` once: the photo's, then the farthest ones, then those nearest to `nearest_to()`.

    disparity: the field's (`plan.field_disparity(given)`). inpaint, estimate_depth: see `load_inpainter`.
    wanted: called once, after the photo's view was taken; returns the offsets of the views to make, None for all.
    Pixels do not depend on the order of the views. The generator ends once the job is stopped. Raises InputError if the
    transformer's weights cannot be read or there is no such way of inpainting.
    """
    with suppress(Cancelled):
        require_inpainter(inpaint)
        nothing = np.zeros(photo.size, np.bool_)
        colors = encode_for_storage(photo.pixels, photo.is_hdr)
        yield ViewUpdate(*plan.grid.centre, colors, disparity.values, nothing)
        chosen = wanted()
        views = [plan.grid.offset(v, u) for v, u in np.ndindex(*plan.grid) if (v, u) != plan.grid.centre]
        views = [at for at in views if chosen is None or at in chosen]
        if not views:
            return
        # A model is not loaded for nothing.
        inpainter = load_inpainter(inpaint if plan.has_disocclusion else DEFAULT_INPAINTER, estimate_depth)
        yield from _generate_views(photo, disparity, plan, nearest_to, inpainter, views)


def _generate_views(
    photo: Photo,
    disparity: Disparity,
    plan: ScenePlan,
    nearest_to: Callable[[], ViewOffset],
    inpainter: Inpainter,
    views: list[ViewOffset],
) -> Iterator[ViewUpdate]:
    """Yield the views that follow the photo's. views: all that are wanted; it is used up."""
    renderer = Renderer(shipped_transformer(), inpainter)
    rays, farthest = rays_of_grid(photo, disparity, plan)

    def stored(offset: ViewOffset, view: View) -> ViewUpdate:
        return _stored_view(rays, plan.grid, offset, view, photo.is_hdr)

    for offset, view in update(rays, farthest, renderer):
        if offset in views:
            views.remove(offset)
            yield stored(offset, view)
    yield from side_by_side(
        lambda offset: stored(offset, renderer.render(rays, offset)), nearest_first(views, nearest_to)
    )


def rays_of_grid(photo: Photo, disparity: Disparity, plan: ScenePlan) -> tuple[RaySet, Sequence[ViewOffset]]:
    """Return the rays of the photo for `plan.grid`, and the farthest views, which `update` completes the rays by."""
    every = outer_views_of_grid(plan.grid)
    outer = every if plan.has_disocclusion else []
    margins = outpainting_margins(disparity.values, outer)
    return rays_of_photo(photo.pixels, disparity.values, farthest_views(every), len(outer), margins), outer


def complete_rays(photo: Photo, disparity: Disparity, plan: ScenePlan, renderer: Renderer) -> RaySet:
    """Return the rays that every view of `plan.grid` is made of."""
    rays, farthest = rays_of_grid(photo, disparity, plan)
    for _ in update(rays, farthest, renderer):
        pass
    return rays


def stored_colors(rays: RaySet, offset: ViewOffset, view: View, is_hdr: bool) -> StoredColors:
    """Return the colours (H, W, 3) of a view as a light field stores them."""
    stored = encode_for_storage(view.colors, is_hdr, 1)
    return finished_colors(rays, offset, view, stored)


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
        nearest = min(remaining, key=partial(_square_distance, nearest_to()))
        remaining.remove(nearest)
        yield nearest


def _square_distance(one: ViewOffset, other: ViewOffset) -> float:
    return (other.t - one.t) ** 2 + (other.s - one.s) ** 2


def _stored_view(rays: RaySet, grid: GridShape, offset: ViewOffset, view: View, is_hdr: bool) -> ViewUpdate:
    (v, u), (t, s) = grid.centre, offset
    colors = stored_colors(rays, offset, view, is_hdr)
    return ViewUpdate(v + round(t), u + round(s), colors, view.disparity, view.inpainted)
