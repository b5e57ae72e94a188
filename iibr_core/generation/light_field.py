"""Photo + disparity -> the views of a light field, one after the other: the loop of the paper's section 3.

The outer views come first and complete the ray set (`update_loop`); the remaining views may come in any order.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np

from iibr_core.generation.field_work import FieldWork
from iibr_core.generation.outer_views import (
    ALL_VIEWS,
    WantedViews,
    farthest_views,
    outer_views_for,
    outer_views_of_grid,
    outpainting_margins,
)
from iibr_core.generation.plan import ScenePlan
from iibr_core.generation.stored_views import Draft, StoredViews, encode_for_storage
from iibr_core.generation.update_loop import render_outer_views
from iibr_core.inpainting.background import fill_background
from iibr_core.inpainting.inpainter import Inpainter, InpaintingAids
from iibr_core.inpainting.registry import DEFAULT_INPAINTER, INPAINTERS, load_inpainter, require_inpainter
from iibr_core.ray_transformer.inference import TrainedWeights
from iibr_core.rendering.hypotheses import AmbiguousRays
from iibr_core.rendering.photo_rays import rays_of_photo
from iibr_core.rendering.ray_set import RaySet
from iibr_core.rendering.rendered_view import RenderedView
from iibr_core.rendering.renderer import open_renderer
from iibr_core.runtime.resources import resource_folder
from iibr_core.runtime.work import Cancelled
from iibr_core.types import (
    Disparity,
    FloatImage,
    InputError,
    Photo,
    Quality,
    ViewOffset,
    ViewUpdate,
    image_size,
)


def generate(
    photo: Photo,
    disparity: Disparity,
    plan: ScenePlan,
    nearest_to: Callable[[], ViewOffset] = lambda: ViewOffset(0.0, 0.0),
    quality: Quality | None = None,
    inpaint: str = DEFAULT_INPAINTER,
    draft_bytes: int | None = None,
    aids: InpaintingAids | None = None,
    wanted: Callable[[], WantedViews] = lambda: ALL_VIEWS,
) -> Generator[ViewUpdate, None, None]:
    """Yield every view of `plan.grid` once: the photo's own first, then the outer ones, then those nearest to
    `nearest_to()`.

    disparity is the field's (`plan.field_disparity(given)`). Once the job is stopped
    the generator returns. Pixels do not depend on the order of the views. quality: None for the plan's; "fast"
    weighs by the closed form, "balanced" asks the trained transformer where surfaces contest a ray. inpaint: as
    `load_inpainter` takes it. aids: what it may ask. wanted: asked once, after the photo's own view, which views of the
    grid are to follow, and what for: a sum is of fast quality where nobody asked for another.

    draft_bytes: for who wants to see something soon. As far as so much memory holds what is left to be done for them,
    views come twice: as drafts in closed form, in the order above; then, when every view is there, with the
    transformer's say, again nearest first, and nothing else is made again. Outer views, which are rendered again when
    the ray set is complete, do so whatever it is. None: every view comes once, final, in balanced quality the outer
    ones last.

    Raises ValueError if photo and disparity differ in size, InputError if the trained weights cannot be read or there
    is no such way of inpainting.
    """
    if disparity.values.shape != photo.size:
        raise ValueError(f"disparity is {image_size(disparity.values)}, the photo {photo.size}")
    with suppress(Cancelled):
        require_inpainter(inpaint)
        # A model is not loaded for nothing.
        load = partial(load_inpainter, inpaint if plan.has_disocclusion else DEFAULT_INPAINTER, aids)
        colors = encode_for_storage(photo.pixels, photo.is_hdr)
        views = [plan.grid.offset(v, u) for v in range(plan.grid.rows) for u in range(plan.grid.columns)]
        nothing = np.zeros(photo.size, np.bool_)
        yield ViewUpdate(*plan.grid.centre, colors, disparity.values, nothing, share=float(len(views) == 1))
        chosen = wanted()
        views = [at for at in views if at != (0.0, 0.0) and (chosen.offsets is None or at in chosen.offsets)]
        if not views:
            return
        quality = quality or ("fast" if chosen.seen == "sum" else plan.quality)
        outer = outer_views_for(outer_views_of_grid(plan.grid), chosen) if plan.has_disocclusion else []
        wanted_outer = len(set(outer).intersection(views))
        counts = len(outer), wanted_outer, len(views) - wanted_outer
        work = FieldWork(plan.costs, quality, counts, inpaint not in INPAINTERS)
        yield from _generate_views(photo, disparity, plan, nearest_to, load, draft_bytes, work, views, outer)


def _generate_views(
    photo: Photo,
    disparity: Disparity,
    plan: ScenePlan,
    nearest_to: Callable[[], ViewOffset],
    load: Callable[[], Inpainter],
    draft_bytes: int | None,
    work: FieldWork,
    inner: list[ViewOffset],
    outer: list[ViewOffset],
) -> Iterator[ViewUpdate]:
    """The views that follow the photo's own. inner: all that are wanted; it is used up. outer: see `ray_set`."""
    grid = plan.grid
    transformer, inpainter = transformer_for(work.quality), load()
    rays, outer_views = ray_set(photo, disparity, plan, inpainter, outer)
    with open_renderer(transformer, inpainter=inpainter) as renderer:
        views = StoredViews(renderer, rays, grid, photo.is_hdr)
        # What is left to be done for views that are there, or in the ray set.
        unfinished: dict[ViewOffset, Callable[[], ViewUpdate]] = {}
        outer_offsets = set[ViewOffset]()
        for offset, view in outer_views:
            is_wanted, share = offset in inner, work.add(work.outer)
            if is_wanted:
                inner.remove(offset)
                outer_offsets.add(offset)
            if is_wanted and transformer is not None:
                unfinished[offset] = partial(views.make, offset)
            if is_wanted and (transformer is None or draft_bytes is not None):
                yield replace(views.update(offset, view, is_final=transformer is None), share=share)
        room = draft_bytes or 0 if transformer is not None else 0

        def start(offset: ViewOffset) -> Draft:
            if room > 0:
                return views.draft(offset)
            made = views.make(offset)
            return Draft(made, made.colors, [])

        for draft in renderer.side_by_side(start, nearest_first(inner, nearest_to)):
            if draft.undecided:
                room -= draft.nbytes
                v, u = draft.update.row, draft.update.column
                unfinished[grid.offset(v, u)] = partial(views.finish, draft)
            left = work.finish_inner if draft.undecided else 0.0
            yield replace(draft.update, share=work.add(work.inner - left))
        for update in renderer.side_by_side(
            lambda offset: unfinished.pop(offset)(), nearest_first(list(unfinished), nearest_to)
        ):
            was_outer = grid.offset(update.row, update.column) in outer_offsets
            yield replace(update, share=work.add(work.finish_outer if was_outer else work.finish_inner))


def ray_set(
    photo: Photo,
    disparity: Disparity,
    plan: ScenePlan,
    inpainter: Inpainter = fill_background,
    outer: list[ViewOffset] | None = None,
) -> tuple[RaySet, Iterator[tuple[ViewOffset, RenderedView]]]:
    """The rays that every view of `plan.grid` is made of, and the outer views by their offsets. outer: which of those
    are made; None: all.

    The set is final once the outer views have been taken: each adds what it disoccluded. Taking one raises.
    """
    every = outer_views_of_grid(plan.grid)
    farthest = farthest_views(every)
    if not plan.has_disocclusion:
        every = []
    margins = outpainting_margins(disparity.values, every)
    outer = every if outer is None else outer
    rays = rays_of_photo(photo.pixels, disparity.values, farthest, len(outer), margins)
    return rays, render_outer_views(rays, outer, inpainter)


def transformer_for(quality: Quality) -> Callable[[AmbiguousRays], FloatImage] | None:
    """What weighs ambiguous rays: the shipped transformer, or None for the closed form.

    Raises InputError if the shipped weights cannot be read.
    """
    if quality == "fast":
        return None
    try:
        return TrainedWeights(resource_folder("assets") / "weights" / "ray_transformer.safetensors")
    except InputError as error:
        raise InputError(f"{error}; use --quality fast, or train them again with `iibr train`") from error


def nearest_first(remaining: list[ViewOffset], nearest_to: Callable[[], ViewOffset]) -> Iterator[ViewOffset]:
    """Each time the view nearest to where the user looks then; the first of equals. It is taken out of the list."""
    while remaining:
        nearest = min(remaining, key=partial(_square_distance, nearest_to()))
        remaining.remove(nearest)
        yield nearest


def _square_distance(one: ViewOffset, other: ViewOffset) -> float:
    return (other.t - one.t) ** 2 + (other.s - one.s) ** 2
