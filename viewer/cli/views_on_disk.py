"""Write the views that `iibr generate` makes: light fields, denser grids, pictures of any cameras. Imports Numba."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import NamedTuple

from iibr_core.beyond.free_cameras import FreeViews, depths_of, fitted_cameras, inverse_depth_of, reach_of
from iibr_core.color import photo_in_srgb
from iibr_core.depth.choice import DepthOrigin
from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields.light_field_formats import open_light_field
from iibr_core.formats.outputs import write_folder
from iibr_core.formats.poses import central_camera, read_poses
from iibr_core.gloss.settings import Gloss
from iibr_core.inpainting.registry import load_inpainter
from iibr_core.method.light_field import encode_for_storage
from iibr_core.method.memory import MAKING_BYTES, require_memory
from iibr_core.runtime.work import report_progress
from iibr_core.scenes.light_fields import read_dense
from iibr_core.scenes.opening import scene_of_photo
from iibr_core.scenes.photo import depth_estimator, load_photo, make_plan, views_of_photo
from iibr_core.scenes.scene import MAKING, LoadedPhoto, Source
from iibr_core.scenes.scene_gloss import add_gloss
from iibr_core.types import Camera, FloatImage, GridShape, ImageSize, InputError, ViewUpdate, image_size

MAX_INPAINTED = 0.5
"""Share of a picture; poses with a larger inpainted share are named."""
MAX_NAMED = 5

WriteField = Callable[..., None]
"""`write_light_field` without views, focal length and name."""


class Written(NamedTuple):
    """Report on written views. summary: their number, size and time. origin: origin of depth, None for light fields."""

    summary: str
    notes: tuple[str, ...]
    origin: DepthOrigin | None = None


def write_field(source: Source, write: WriteField, depth_strength: float, gloss: Gloss | None) -> Written:
    """Write the light field of a photo. Raises InputError."""
    loaded = load_photo(source)
    photo, plan = loaded.photo, make_plan(source, loaded, depth_strength, keeps_views=False)
    with closing(views_of_photo(source, loaded, plan)) as plain:
        views = add_gloss(plain, gloss, scene_of_photo(source, loaded, plan))
        named = partial(write, focal_px=photo.focal_px, name=photo.name)
        summary = _write_views(views, math.prod(plan.grid), photo.size, named)
    return Written(summary, photo.notes + loaded.disparity.notes + plan.notes, loaded.origin)


def write_dense_field(source: Source, grid: GridShape, write: WriteField) -> Written:
    """Write the views of a light field and those between them. Raises InputError."""
    field = open_light_field(Path(source.path))
    given, _, all_views = read_dense(field, grid, source.inpaint)
    size = image_size(given[0].colors)
    with closing(all_views) as views:
        named = partial(write, focal_px=field.focal_px or float(size.width), name=field.name)
        return Written(_write_views(views, math.prod(grid), size, named), field.notes)


def _write_views(
    views: Iterator[ViewUpdate], count: int, size: ImageSize, write: Callable[[Iterator[ViewUpdate]], None]
) -> str:
    """Write views and return a sentence about them and the time that making them took."""
    seconds = 0.0

    def timed() -> Iterator[ViewUpdate]:
        nonlocal seconds
        start = time.perf_counter()
        for done, view in enumerate(views, 1):
            seconds += time.perf_counter() - start
            yield view
            report_progress(done, count, MAKING)
            start = time.perf_counter()

    write(timed())
    return f"{count} views of {size} in {seconds:.2f} s ({1000 * seconds / count:.1f} ms per view)"


def write_free_views(source: Source, poses: Path, photo_pose: int | None, is_literal: bool, folder: Path) -> Written:
    """Write a picture for each pose, view_0001.png and so on.

    photo_pose: number of the photo's pose, from 1; None: the middle one. is_literal: disparity is in px per unit of
    length. Raises InputError.
    """
    known = read_poses(poses)
    if photo_pose is not None and photo_pose > len(known):
        raise InputError(f"--photo-pose {photo_pose}: {poses} has {len(known)} poses")
    given = central_camera(known) if photo_pose is None else photo_pose - 1
    loaded = load_photo(source)
    cameras = fitted_cameras(known, given, loaded.photo.size)
    start = time.perf_counter()
    views = _free_views(source, loaded, is_literal, cameras, given)
    inpainted = _write_pictures(folder, views, cameras, loaded.photo.is_hdr)
    seconds = time.perf_counter() - start
    summary = f"{len(cameras)} views in {seconds:.2f} s ({1000 * seconds / len(cameras):.1f} ms per view)"
    place = f"The photo's pose is {cameras[given].source}."
    notes = (*loaded.photo.notes, *loaded.disparity.notes, place, *_inpainted_notes(inpainted))
    return Written(summary, notes, loaded.origin)


def _free_views(
    source: Source, loaded: LoadedPhoto, is_literal: bool, cameras: Sequence[Camera], given: int
) -> FreeViews:
    photo, inverse_depth = photo_in_srgb(loaded.photo), _inverse_depth(loaded, is_literal, cameras[given])
    canvas = reach_of(cameras[given], cameras, depths_of(inverse_depth)).margins.around(photo.size)
    require_memory(math.prod(canvas) * MAKING_BYTES, f"making views from a canvas of {canvas} px")
    inpainter = load_inpainter(source.inpaint, depth_estimator(source, loaded))
    return FreeViews(photo.pixels, inverse_depth, cameras[given], cameras, inpainter=inpainter)


def _write_pictures(folder: Path, views: FreeViews, cameras: Sequence[Camera], is_hdr: bool) -> list[float]:
    """Write the views to a folder. Return the inpainted share of each."""
    shares = []
    with write_folder(folder) as unfinished:
        for number, camera in enumerate(cameras, 1):
            view = views.view(camera)
            name = f"view_{number:04d}{'.exr' if is_hdr else '.png'}"
            write_image(unfinished / name, encode_for_storage(view.colors, is_hdr))
            shares.append(float(view.inpainted.mean()))
            report_progress(number, len(cameras), MAKING)
    return shares


def _inverse_depth(loaded: LoadedPhoto, is_literal: bool, camera: Camera) -> FloatImage:
    """Return 1 / depth (H, W) of the photo in the unit of the poses. Raises InputError if disparity is not positive."""
    values = loaded.disparity.values
    if not is_literal:
        return inverse_depth_of(values, camera.depth_range)
    if not values.min() > 0:
        raise InputError(f"{loaded.disparity.source}: --literal needs disparity above 0 everywhere")
    focal_px: float = camera.focal_px[0]
    return values / values.dtype.type(focal_px)


def _inpainted_notes(shares: Sequence[float]) -> tuple[str, ...]:
    """Return a sentence about the poses that show mostly inpainted areas."""
    many = [f"{number} ({share:.0%})" for number, share in enumerate(shares, 1) if share > MAX_INPAINTED]
    if not many:
        return ()
    named = ", ".join(many[:MAX_NAMED]) + (" and others" if len(many) > MAX_NAMED else "")
    return (f"These poses show mostly inpainted areas, which the photo does not show: {named}.",)
