"""Write the views that `iibr generate` makes: light fields, denser grids, pictures of any cameras. Imports Numba."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing
from pathlib import Path
from typing import NamedTuple, TypeVar

from iibr_core.beyond.free_cameras import FreeViews, depths_of, fitted_cameras, inverse_depth_of, reach_of
from iibr_core.color import photo_in_srgb
from iibr_core.depth.choice import DepthOrigin
from iibr_core.formats.images.write import write_image
from iibr_core.formats.light_fields.order import step_length
from iibr_core.formats.light_fields.views import row_step_of
from iibr_core.formats.light_fields.write import FieldScale, note_on_rows
from iibr_core.formats.outputs import write_folder
from iibr_core.formats.poses import central_camera, read_poses
from iibr_core.gloss.settings import Gloss
from iibr_core.inpainting.registry import load_inpainter
from iibr_core.method.light_field import encode_for_storage
from iibr_core.method.memory import MAKING_BYTES, require_memory
from iibr_core.runtime.work import report_progress
from iibr_core.scenes import photo as photos
from iibr_core.scenes.light_fields import open_settled, read_dense
from iibr_core.scenes.opening import scene_of_photo
from iibr_core.scenes.scene import MAKING, LoadedPhoto, Source
from iibr_core.scenes.scene_gloss import add_gloss
from iibr_core.types import Camera, FloatImage, GridShape, InputError, image_size

MAX_INPAINTED = 0.5
"""Share of a picture; poses with a larger inpainted share are named."""
MAX_NAMED = 5
"""Largest number of poses that are named."""

View = TypeVar("View")
WriteField = Callable[..., None]
"""`write_light_field` without views, focal length, name and scale."""


class Written(NamedTuple):
    """Report on written views. views: their number and size. origin: origin of depth, None for light fields."""

    views: str
    notes: tuple[str, ...]
    origin: DepthOrigin | None = None


def _reported(views: Iterable[View], count: int) -> Iterator[View]:
    """Yield the views and report progress."""
    for done, view in enumerate(views, 1):
        yield view
        report_progress(done, count, MAKING)


def write_field(source: Source, write: WriteField, depth_strength: float, gloss: Gloss | None) -> Written:
    """Write the light field of a photo. Raises InputError."""
    loaded = photos.load_photo(source)
    photo, plan = loaded.photo, photos.make_plan(source, loaded, depth_strength, keeps_views=False)
    count = math.prod(plan.grid)
    with closing(photos.views_of_photo(source, loaded, plan)) as plain:
        scene = scene_of_photo(source, loaded, plan)
        views = _reported(add_gloss(plain, gloss, scene), count)
        write(views, focal_px=photo.focal_px, name=photo.name, scale=FieldScale(scene.infinity_px))
    return Written(f"{count} views of {photo.size}", photo.notes + loaded.disparity.notes + plan.notes, loaded.origin)


def write_dense_field(source: Source, grid: GridShape, write: WriteField) -> Written:
    """Write the views of a light field and those between them. Raises InputError."""
    field, notes = open_settled(source)
    given, steps, all_views = read_dense(field, grid, source.inpaint)
    size = image_size(given[0].colors)
    count = math.prod(grid)
    with closing(all_views) as views:
        infinity_px = None if field.infinity_px is None else field.infinity_px * step_length(field) / steps
        scale = FieldScale(infinity_px)
        write(_reported(views, count), focal_px=field.focal_px or float(size.width), name=field.name, scale=scale)
    note = note_on_rows(row_step_of(field))
    return Written(f"{count} views of {size}", (*notes, note) if note else notes)


def write_free_views(source: Source, poses: Path, photo_pose: int | None, is_literal: bool, folder: Path) -> Written:
    """Write a picture for each pose, view_0001.png and so on.

    photo_pose: number of the photo's pose, from 1; None: the middle one. is_literal: disparity is in px per unit of
    length. Raises InputError.
    """
    known = read_poses(poses)
    if photo_pose is not None and photo_pose > len(known):
        raise InputError(f"--photo-pose {photo_pose}: {poses} has {len(known)} poses")
    given = central_camera(known) if photo_pose is None else photo_pose - 1
    loaded = photos.load_photo(source)
    photo = loaded.photo
    cameras = fitted_cameras(known, given, photo.size)
    views = _free_views(source, loaded, is_literal, cameras, given)
    shares = []
    with write_folder(folder) as unfinished:
        for number, view in enumerate(_reported(map(views.view, cameras), len(cameras)), 1):
            name = f"view_{number:04d}{'.exr' if photo.is_hdr else '.png'}"
            write_image(unfinished / name, encode_for_storage(view.colors, photo.is_hdr))
            shares.append(float(view.inpainted.mean()))
    place = f"The photo's pose is {cameras[given].source}."
    notes = (*photo.notes, *loaded.disparity.notes, place, *_inpainted_notes(shares))
    return Written(f"{len(cameras)} views", notes, loaded.origin)


def _free_views(
    source: Source, loaded: LoadedPhoto, is_literal: bool, cameras: Sequence[Camera], given: int
) -> FreeViews:
    photo, inverse_depth = photo_in_srgb(loaded.photo), _inverse_depth(loaded, is_literal, cameras[given])
    canvas = reach_of(cameras[given], cameras, depths_of(inverse_depth)).margins.around(photo.size)
    require_memory(math.prod(canvas) * MAKING_BYTES, f"making views from a canvas of {canvas} px")
    inpainter = load_inpainter(source.inpaint, photos.depth_estimator(source, loaded))
    return FreeViews(photo.pixels, inverse_depth, cameras[given], cameras, inpainter=inpainter)


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
