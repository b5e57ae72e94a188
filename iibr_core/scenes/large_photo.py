"""The open photo at its own size, which is read again when a picture of that size is needed."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from iibr_core.beyond.full_size import LargePhoto
from iibr_core.beyond.hidden_surfaces import HiddenSurface, SeenBehind, hidden_surface
from iibr_core.depth.edges.refine import refine
from iibr_core.depth.editing.canvas import apply_edits
from iibr_core.depth.editing.edits import UNEDITED
from iibr_core.depth.embedded.embedded import photo_in_focus, read_embedded
from iibr_core.depth.search import find_depth
from iibr_core.formats.files import stamp_of
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.maps.reader import read_map_size
from iibr_core.formats.maps.resample import resample_surfaces
from iibr_core.method.light_field import view_maker
from iibr_core.method.plan import ScenePlan
from iibr_core.method.rays import RaySet
from iibr_core.runtime.tiling import THREADS
from iibr_core.runtime.work import raise_if_stopped
from iibr_core.scenes.lens_limits import aperture_limit
from iibr_core.scenes.scene import LoadedPhoto, Scene, Source
from iibr_core.types import Disparity, FloatImage, InputError, Photo, ViewOffset


def read_large(source: Source, loaded: LoadedPhoto, max_pixels: int) -> Photo:
    """Return the photo of `source`, which was `loaded` smaller, in the colours of its file, with at most max_pixels."""
    path = Path(source.path)
    if stamp_of(path) != loaded.stamp:
        raise InputError(f"{path}: was changed since it was opened; open it again")
    photo = read_photo(path, max_pixels, keeps_primaries=True)
    if loaded.origin.kind == "embedded" and (embedded := read_embedded(path)) is not None:
        photo = photo_in_focus(path, photo, embedded, max_pixels)
    raise_if_stopped()
    return photo


def load_large(source: Source, loaded: LoadedPhoto, plan: ScenePlan, max_pixels: int) -> LargePhoto:
    """Return the photo of `source`, which was `loaded` smaller, with at most max_pixels and without `fills`.

    Its disparity is the same, with edges drawn to those of the larger photo.
    """
    photo = read_large(source, loaded, max_pixels)
    enlarged = photo.size.width / loaded.photo.size.width
    values = _disparity(source, loaded, photo)
    raise_if_stopped()
    field = plan.field_disparity(Disparity(values / np.float32(enlarged), loaded.disparity.source))
    return LargePhoto(photo.pixels, field.values * np.float32(enlarged))


def complete_fills(source: Source, loaded: LoadedPhoto, plan: ScenePlan) -> RaySet | None:
    """Return the complete ray set of the light field, None if nothing is disoccluded."""
    if not plan.has_disocclusion:
        return None
    disparity = plan.field_disparity(loaded.disparity)
    return view_maker(loaded.photo, disparity, plan, source.inpaint).rays


def hidden_of_photo(loaded: LoadedPhoto, plan: ScenePlan, scene: Scene, fills: RaySet | None) -> HiddenSurface:
    """Return the surface behind the photo's, as large as a view. fills: see `complete_fills`."""
    disparity, seen = plan.field_disparity(loaded.disparity).values, list[SeenBehind]()
    if fills is not None:
        rays = fills.arrays
        for k in range(fills.photo_images, len(fills)):
            parts = (fills.in_view(image[k]) for image in (rays.colors, rays.disparity, rays.coverage))
            colors, values, coverage = parts
            seen.append(SeenBehind(ViewOffset(*rays.offsets[k]), colors, values, coverage > 0))
    radius = aperture_limit(scene) / 2
    return hidden_surface(loaded.photo.pixels, disparity, radius, seen, THREADS)


def _disparity(source: Source, loaded: LoadedPhoto, photo: Photo) -> FloatImage:
    """Return the disparity of the larger photo, in its pixels, with the edits that were made to the smaller one."""
    settings, enlarged = loaded.depth_settings, np.float32(photo.size.width / loaded.photo.size.width)
    if enlarged == 1:
        return loaded.disparity.values
    file = Path(loaded.origin.file) if loaded.origin.file is not None else None
    if file is not None and math.prod(read_map_size(file)) > math.prod(loaded.photo.size):
        choice = replace(source.depth, file=str(file), refine=False)
        given = find_depth(Path(source.path), photo, choice, source.grid).disparity
    else:
        file = None
        given = Disparity(resample_surfaces(loaded.disparity.values, photo.size) * enlarged, loaded.disparity.source)
    raise_if_stopped()
    values = given.values
    if settings.refine:
        values = refine(photo.pixels, values, given.unknown, is_enlarged=given.is_enlarged)
    if file is None or settings.edits == UNEDITED:
        return values
    return apply_edits(photo.pixels, values / enlarged, settings.edits) * enlarged
