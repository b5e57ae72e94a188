"""Photo + disparity -> the views of a light field, one after the other: the loop of the paper's section 3.

The farthest views come first. What they disocclude is inpainted once and joins the ray set, so all later views show
the same content there. Then the ray set is final, and the remaining views may come in any order.
"""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterator
from contextlib import suppress

import numpy as np

from iibr_core.color import stored_from_encoded
from iibr_core.generation.plan import ScenePlan
from iibr_core.rendering.ambiguous_rays import AmbiguousRays
from iibr_core.rendering.ray_set import RaySet
from iibr_core.rendering.view_synthesis import RenderedView, ViewSynthesis, rays_of_photo
from iibr_core.runtime.resources import resource_folder
from iibr_core.runtime.tiling import Cancelled, ShouldStop, in_bands, never
from iibr_core.types import (
    DEFAULT_QUALITY,
    Disparity,
    FloatImage,
    GridShape,
    InputError,
    Photo,
    Quality,
    StoredColors,
    ViewOffset,
    ViewUpdate,
    image_size,
)


def generate(
    photo: Photo,
    disparity: Disparity,
    plan: ScenePlan,
    should_stop: ShouldStop = never,
    nearest_to: Callable[[], ViewOffset] = lambda: ViewOffset(0.0, 0.0),
    quality: Quality = DEFAULT_QUALITY,
) -> Generator[ViewUpdate, None, None]:
    """Yield every view of `plan.grid` once: the photo's own first, then the farthest, then those nearest to
    `nearest_to()`.

    disparity is the field's (`plan.field_disparity(given)`). should_stop is asked every few milliseconds; once it
    is true the generator returns. Pixels do not depend on the order of the views. quality: "fast" weighs by the
    closed form, "balanced" asks the trained transformer where surfaces contest a ray, "exact" asks it for every ray;
    the farthest views then come with the others, once the ray set is complete.

    Raises ValueError if photo and disparity differ in size, InputError if the trained weights cannot be read.
    """
    if disparity.values.shape != photo.size:
        raise ValueError(f"disparity is {image_size(disparity.values)}, the photo {photo.size}")
    with suppress(Cancelled):
        yield from _generate_views(photo, disparity, plan, should_stop, nearest_to, quality)


def _generate_views(
    photo: Photo,
    disparity: Disparity,
    plan: ScenePlan,
    should_stop: ShouldStop,
    nearest_to: Callable[[], ViewOffset],
    quality: Quality,
) -> Iterator[ViewUpdate]:
    grid = plan.grid
    colors = _encode_for_storage(photo.pixels, photo.is_hdr, should_stop)
    yield ViewUpdate(*grid.centre, colors, disparity.values, np.zeros(photo.size, np.bool_))
    remaining = [(v, u) for v in range(grid.rows) for u in range(grid.columns) if (v, u) != grid.centre]
    if not remaining:
        return

    def update(index: tuple[int, int], view: RenderedView, threads: int | None = None) -> ViewUpdate:
        colors = _encode_for_storage(view.colors, photo.is_hdr, should_stop, threads)
        return ViewUpdate(*index, colors, view.disparity, view.inpainted)

    transformer = transformer_for(quality)
    rays, farthest_views = ray_set(photo, disparity, plan, should_stop)
    for index, view in farthest_views:
        if transformer is None:
            remaining.remove(index)
            yield update(index, view)
    # At every quality the ray set is the closed form's: its disparity is smoother, and so is what is inpainted.
    with ViewSynthesis(should_stop, transformer, quality == "exact") as synthesis:

        def made(index: tuple[int, int]) -> ViewUpdate:
            return update(index, synthesis.render_alone(rays, grid.offset(*index)), threads=1)

        yield from synthesis.side_by_side(made, _nearest_first(grid, remaining, nearest_to))


def ray_set(
    photo: Photo, disparity: Disparity, plan: ScenePlan, should_stop: ShouldStop = never
) -> tuple[RaySet, Iterator[tuple[tuple[int, int], RenderedView]]]:
    """The rays that every view of `plan.grid` is made of, and the farthest views by their indices.

    The set is final once the farthest views have been taken: each adds what it disoccluded. Taking one raises Cancelled
    once should_stop is true.
    """
    grid = plan.grid
    farthest = max(*map(abs, grid.offset(0, 0)), *map(abs, grid.offset(grid.rows - 1, grid.columns - 1)), 1.0)
    indices = _farthest_views(grid) if plan.has_disocclusion else []
    rays = rays_of_photo(photo.pixels, disparity.values, farthest, len(indices), should_stop)
    return rays, _complete_ray_set(rays, grid, indices, should_stop)


def _complete_ray_set(
    rays: RaySet, grid: GridShape, indices: list[tuple[int, int]], should_stop: ShouldStop
) -> Iterator[tuple[tuple[int, int], RenderedView]]:
    with ViewSynthesis(should_stop) as synthesis:
        for index in indices:
            offset = grid.offset(*index)
            view = synthesis.render(rays, offset)
            if view.occluded.any():
                rays.add(offset, view.colors, view.disparity, view.occluded.astype(np.float32), should_stop)
            yield index, view


def transformer_for(quality: Quality) -> Callable[[AmbiguousRays], FloatImage] | None:
    """What weighs ambiguous rays: the shipped transformer, or None for the closed form.

    Raises InputError if the shipped weights cannot be read.
    """
    if quality == "fast":
        return None
    from iibr_core.ray_transformer.inference import TrainedWeights

    try:
        return TrainedWeights(resource_folder("assets") / "weights" / "ray_transformer.safetensors")
    except InputError as error:
        raise InputError(f"{error}; use --quality fast, or train them anew with `iibr train`") from error


def _farthest_views(grid: GridShape) -> list[tuple[int, int]]:
    """Corners, then the middles of the sides: together they see all but slivers of what any view disoccludes."""
    bottom, right = grid.rows - 1, grid.columns - 1
    v, u = grid.centre
    indices = [(0, 0), (bottom, right), (0, right), (bottom, 0), (v, 0), (v, right), (0, u), (bottom, u)]
    return [index for index in dict.fromkeys(indices) if index != grid.centre]


def _nearest_first(
    grid: GridShape, remaining: list[tuple[int, int]], nearest_to: Callable[[], ViewOffset]
) -> Iterator[tuple[int, int]]:
    """Each time the index whose view is nearest to where the user looks then; the first of equals."""

    def distance(index: tuple[int, int]) -> float:
        offset = grid.offset(*index)
        return (offset.t - eye.t) ** 2 + (offset.s - eye.s) ** 2

    while remaining:
        eye = nearest_to()
        index = min(remaining, key=distance)
        remaining.remove(index)
        yield index


def _encode_for_storage(
    encoded: FloatImage, is_hdr: bool, should_stop: ShouldStop, threads: int | None = None
) -> StoredColors:
    """`stored_from_encoded`, in bands."""
    stored = np.empty(encoded.shape, np.float16 if is_hdr else np.uint8)

    def band(first: int, last: int) -> None:
        stored[first:last] = stored_from_encoded(encoded[first:last], is_hdr)

    in_bands(band, image_size(encoded), should_stop, threads)
    return stored
