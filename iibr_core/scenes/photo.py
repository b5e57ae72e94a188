"""A photo and its disparity as the worker holds them: read once, then refined and edited as often as the user likes;
its plan, and its views.
"""

import math
from collections.abc import Callable, Collection, Generator
from dataclasses import replace
from pathlib import Path

import numpy as np

from iibr_core.beyond.lens import light_of
from iibr_core.beyond.optics import Optics
from iibr_core.color import photo_in_srgb, srgb_from_linear
from iibr_core.depth.choice import DepthOrigin
from iibr_core.depth.edges.refine import refine
from iibr_core.depth.editing.canvas import DepthCanvas
from iibr_core.depth.editing.edits import BRUSH_TOOLS, UNEDITED, DepthEdits, Levels, Stroke, extent_of, levels_of
from iibr_core.depth.search import PhotoWithDepth, SlowSource, estimator_of, find_depth, open_with_depth
from iibr_core.formats.files import stamp_of
from iibr_core.formats.images.open_picture import settings_text_in
from iibr_core.formats.images.photo import DEFAULT_MAX_PIXELS, focal_px_from_fov, read_thumbnail, size_within
from iibr_core.formats.images.side_by_side import photo_size
from iibr_core.formats.light_fields.light_field_formats import is_view_file
from iibr_core.inpainting.registry import EstimateDepth
from iibr_core.method.disparity_range import measure_disparity_range
from iibr_core.method.light_field import ViewMaker, view_maker
from iibr_core.method.plan import MAX_DEPTH_STRENGTH, PlanOverrides, ScenePlan, plan_for_viewing, plan_literal
from iibr_core.method.view import View
from iibr_core.runtime.kernels import KERNELS_OF_A_PHOTO, kernel_count
from iibr_core.runtime.machine import give_back_memory
from iibr_core.scenes.scene import DepthSettings, LoadedPhoto, Source, still_disparity
from iibr_core.types import (
    CENTRE,
    Disparity,
    FloatImage,
    GridShape,
    ImageSize,
    InputError,
    Photo,
    ViewOffset,
    ViewUpdate,
)

SKETCH = ImageSize(height=480, width=480)
"""Largest size of a sketch."""
FIRST_SKETCH = ImageSize(height=1000, width=1000)
"""The same where kernels are to be compiled first, which takes long."""
SKETCH_WORTH_PIXELS = 1_500_000
"""Number of pixels from which on a photo gets a sketch: smaller ones are read quickly, unless kernels are missing."""
MAX_SIDE_PX = 16_384
"""Longest side of an open photo in pixels: the limit of most graphics drivers."""


def load_photo(source: Source, depth_settings: DepthSettings | None = None, asks_model: bool = True) -> LoadedPhoto:
    """Read a photo and find its disparity.

    depth_settings: refinement and edits of the disparity, None for those of the source. asks_model: False to guess
    depth where a model would estimate it.
    """
    path = Path(source.path)
    max_pixels, stored_size = _pixels_to_read(source)
    stamp = stamp_of(path)
    skipped: tuple[SlowSource, ...] = () if asks_model else ("model",)
    found = open_with_depth(path, replace(source.depth, refine=False), max_pixels, source.grid, skipped)
    give_back_memory()
    own_size = _turned_like(stored_size, found.photo.size)
    loaded = _loaded(found, settings_text_in(path), source, own_size, stamp)
    return apply_depth_settings(loaded, depth_settings or DepthSettings(source.depth.refine))


def deepen(source: Source, loaded: LoadedPhoto, refines: bool) -> LoadedPhoto:
    """Return the same photo with the depth that a model estimates, refined or not, and not edited."""
    choice = replace(source.depth, start="model", file=None, refine=False)
    found = find_depth(Path(source.path), loaded.photo, choice, source.grid)
    deepened = _loaded(found, loaded.settings, source, loaded.own_size, loaded.stamp)
    return apply_depth_settings(deepened, DepthSettings(refines))


def sketch_photo(source: Source) -> LoadedPhoto | None:
    """Return a photo at a small size with depth that is found quickly, to be shown while it is read.

    None if it is not worth while.
    """
    path = Path(source.path)
    max_pixels, stored_size = _pixels_to_read(source)
    stamp = stamp_of(path)
    lacks_kernels = kernel_count() < KERNELS_OF_A_PHOTO
    is_large = min(math.prod(stored_size), max_pixels) >= SKETCH_WORTH_PIXELS
    if source.is_literal or not (is_large or lacks_kernels):
        return None
    pixels = read_thumbnail(path, FIRST_SKETCH if lacks_kernels else SKETCH).astype(np.float32) / np.float32(255)
    photo = Photo(pixels, focal_px_from_fov(pixels.shape[1]), path.stem, is_hdr=False)
    found = find_depth(path, photo, replace(source.depth, refine=False), skipped=("pair", "model"))
    return _loaded(found, "", source, _turned_like(stored_size, photo.size), stamp)


def photo_of_arrays(photo: Photo, disparity: Disparity) -> LoadedPhoto:
    """Return a photo and its disparity as they were given, from no file: nothing is refined."""
    found = PhotoWithDepth(photo, disparity, DepthOrigin("file", disparity.source))
    return _loaded(found, "", Source(""), photo.size, ())


def apply_depth_settings(loaded: LoadedPhoto, depth_settings: DepthSettings) -> LoadedPhoto:
    """Return the same photo with other refinement and edits; only what changed is computed."""
    if loaded.depth_settings == depth_settings:
        return loaded
    if loaded.depth_settings.refine != depth_settings.refine:
        loaded = _refine(loaded, depth_settings.refine)
    values = loaded.canvas.apply(depth_settings.edits)
    return replace(
        loaded,
        depth_settings=depth_settings,
        disparity=replace(loaded.refined, values=values),
        levels=_levels(loaded, depth_settings.edits, values),
    )


def _levels(loaded: LoadedPhoto, edits: DepthEdits, values: FloatImage) -> Levels:
    """Return the histogram of the map with its strokes, but before inversion, clips and gamma."""
    given = loaded.refined.values
    if not edits.strokes:
        return levels_of(given)
    moved = values - loaded.canvas.without_strokes(edits)
    return levels_of(given - moved if edits.is_inverted else given + moved, extent_of(given))


def prepare_brush() -> None:
    """Load or compile the brush's kernels, so that the first stroke does not wait for them."""
    strokes = tuple(Stroke(tool, ((0.5, 0.5),), 0.1, 0.5) for tool in BRUSH_TOOLS)
    DepthCanvas(np.zeros((4, 4, 3), np.float32), np.zeros((4, 4), np.float32)).apply(DepthEdits(strokes=strokes))


def depth_estimator(source: Source, loaded: LoadedPhoto) -> EstimateDepth | None:
    """Return the model that found the depth of this photo, None if it was no model."""
    found = PhotoWithDepth(loaded.photo, loaded.found, loaded.origin)
    return estimator_of(found, source.depth)


def make_plan(source: Source, loaded: LoadedPhoto, depth_strength: float, keeps_views: bool = True) -> ScenePlan:
    """Return the plan for viewing, or for literal disparity. Places without edits keep their parallax.

    keeps_views: False if each view is written and forgotten.
    """
    if source.is_literal:
        if source.grid is None:
            raise InputError("literal disparity counts in px from view to view: give the grid of views")
        return plan_literal(loaded.photo, loaded.disparity, source.grid, keeps_views, source.inpaint)
    zero = source.focus_disparity
    if loaded.depth_settings.edits != UNEDITED:
        zero = still_disparity(source, loaded.canvas.without_strokes(loaded.depth_settings.edits))
        range_px, edited_px = (
            measure_disparity_range(map_.values).range for map_ in (loaded.refined, loaded.disparity)
        )
        wanted = depth_strength * (edited_px / range_px if range_px else 1.0)
        depth_strength = min(max(wanted, -MAX_DEPTH_STRENGTH), MAX_DEPTH_STRENGTH)
    overrides = PlanOverrides(source.grid, depth_strength, zero, source.inpaint)
    return plan_for_viewing(loaded.photo, loaded.disparity, overrides, keeps_views)


def views_of_photo(
    source: Source,
    loaded: LoadedPhoto,
    plan: ScenePlan,
    nearest_to: Callable[[], ViewOffset] = lambda: CENTRE,
    in_srgb: bool = True,
    wanted: Callable[[], Collection[ViewOffset] | None] = lambda: None,
) -> Generator[ViewUpdate]:
    """Yield the views as `generate` does, in sRGB or in the photo's colour space."""
    maker = view_maker_of(source, loaded, plan, in_srgb)
    return maker.generate(plan.grid, loaded.photo.is_hdr, nearest_to, wanted)


def view_maker_of(source: Source, loaded: LoadedPhoto, plan: ScenePlan, in_srgb: bool = True) -> ViewMaker:
    """Return the maker of the photo's views, in sRGB or in the photo's colour space."""
    photo = photo_in_srgb(loaded.photo) if in_srgb else loaded.photo
    disparity, estimate_depth = plan.field_disparity(loaded.disparity), depth_estimator(source, loaded)
    return view_maker(photo, disparity, plan, source.inpaint, estimate_depth)


def lens_views_of(
    source: Source, loaded: LoadedPhoto, plan: ScenePlan, optics: Optics, reach: float
) -> Callable[[ViewOffset], View]:
    """Return a maker of the photo's sRGB views up to `reach` view steps away, as a lens needs them.

    Surfaces in focus do not move, so they are as sharp as in the photo; clipped highlights are recovered.
    """
    field, photo, side = plan.field_disparity(loaded.disparity), photo_in_srgb(loaded.photo), 2 * math.ceil(reach) + 1
    gain = optics.highlight_gain(optics.aperture_diameter, photo.is_hdr)
    if gain > 0:
        photo = replace(photo, pixels=srgb_from_linear(light_of(photo.pixels, gain)))
    return view_maker(
        photo,
        replace(field, values=field.values - np.float32(optics.focus_disparity)),
        replace(plan, grid=GridShape(*(max(views, side) for views in plan.grid))),
        source.inpaint,
        depth_estimator(source, loaded),
    ).view


def _turned_like(size: ImageSize, upright: ImageSize) -> ImageSize:
    """Return the size of a stored picture after it was turned upright."""
    is_turned = (size.height < size.width) != (upright.height < upright.width) and size.height != size.width
    return ImageSize(size.width, size.height) if is_turned else size


def _pixels_to_read(source: Source) -> tuple[int, ImageSize]:
    """Return the largest number of pixels to read, and the stored size."""
    path = Path(source.path)
    if is_view_file(path):
        raise InputError(f"{path}: holds the views of a light field, not a photo; open it as a light field")
    size, pixels = photo_size(path), source.max_pixels or DEFAULT_MAX_PIXELS
    if max(size_within(size, pixels)) > MAX_SIDE_PX:
        pixels = max(math.floor(math.prod(size) * (MAX_SIDE_PX / max(size)) ** 2), 1)
    return pixels, size


def _loaded(
    found: PhotoWithDepth, settings: str, source: Source, own_size: ImageSize, stamp: tuple[int, ...]
) -> LoadedPhoto:
    """Return the record of a photo whose disparity is neither refined nor edited."""
    photo, disparity = found.photo, found.disparity
    return LoadedPhoto(
        photo,
        disparity,
        found.origin,
        settings,
        found.origin.model or None,
        DepthSettings(refine=False),
        disparity,
        disparity,
        levels_of(disparity.values),
        DepthCanvas(photo.pixels, disparity.values),
        own_size,
        stamp,
    )


def _refine(loaded: LoadedPhoto, refines: bool) -> LoadedPhoto:
    found = loaded.found
    values = found.values
    if refines:
        values = refine(loaded.photo.pixels, values, found.unknown, is_enlarged=found.is_enlarged)
    canvas = DepthCanvas(loaded.photo.pixels, values)
    return replace(loaded, refined=replace(found, values=values), canvas=canvas)
