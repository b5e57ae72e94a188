"""Views of any cameras from one photo: at other places, turned, nearer, with lenses of their own.

No view of the field is stored: a ray is made when a camera looks along it. The part of the photo's plane through which
the cameras look decides how far the ray set has to be completed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import atan, ceil, cos, sin

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.free_view import render_free_view, target_from_photo
from iibr_core.formats.cameras import infinity_of
from iibr_core.inpainting.background import fill_background
from iibr_core.inpainting.outpainting import outpaint
from iibr_core.inpainting.registry import Inpainter
from iibr_core.method.disparity_range import measure_disparity_range, rounding_step
from iibr_core.method.farthest_views import LOOKUP_MARGIN_PX, farthest_views, outer_views
from iibr_core.method.rays import NO_MARGINS, rays_of_photo
from iibr_core.method.update_loop import update
from iibr_core.method.view import Renderer, View
from iibr_core.runtime.work import report_progress
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.types import Camera, FloatImage, ImageSize, InputError, Margins, ViewOffset, image_size

FARTHEST_STEPS = 4.0
"""Number of view steps to the border of the part of the photo's plane through which cameras look."""
MAX_BEYOND = 0.5
"""Largest margin on each side of the photo, as a share of its width or height."""
MIN_BEYOND_PX = 1e-3
MAX_PARALLAX = 0.5
"""Largest parallax of the nearest against the farthest, as a share of the photo's longer side."""
MAX_SHAPE_DIFFERENCE = 0.02
"""Largest relative difference of aspect ratio between the photo and its pose's picture: smaller copies are rounded."""
SAMPLES_ACROSS = 33
"""Number of samples in each direction of a camera's picture that show which part of the photo it sees."""
MIN_STEP = 1e-6
"""Least length of a view step as a share of the nearest distance; cameras that only turn need no larger one."""

Points = NDArray[np.float64]


def inverse_depth_of(disparity: FloatImage, depth_range: tuple[float, float] | None) -> FloatImage:
    """Return 1 / depth (H, W) of disparity (H, W) in any unit.

    The range of the disparity becomes depth_range, in its unit. None: the unit is the nearest distance, and the
    farthest follows from `infinity_of`.
    """
    span = measure_disparity_range(disparity)
    if depth_range is None:
        at_infinity = infinity_of(span.low, span.high)
        farthest, nearest = (span.low - at_infinity) / (span.high - at_infinity), 1.0
    else:
        nearest, farthest = (1.0 / depth for depth in depth_range)
    # A flat map is in the middle of the range.
    share = (np.clip(disparity, span.low, span.high) - span.low) / span.range if span.range > 0 else 0.5
    return np.full(disparity.shape, farthest + (nearest - farthest) * share, np.float32)


def depths_of(inverse_depth: FloatImage) -> tuple[float, float]:
    """Return the nearest and the farthest depth."""
    return 1 / float(inverse_depth.max()), 1 / float(inverse_depth.min())


@dataclass(frozen=True)
class Reach:
    """The part of a photo's light field that cameras see.

    margins: pixels beyond the photo's frame. step: length of a view step in the world's units. outer: views that show
    the surfaces which the cameras disocclude.
    """

    margins: Margins
    step: float
    outer: tuple[ViewOffset, ...]


def reach_of(photo: Camera, cameras: Sequence[Camera], depths: tuple[float, float]) -> Reach:
    """Return the reach of cameras that look at surfaces between two depths in front of the photo's camera.

    Raises InputError for a camera that sees nothing of the photo.
    """
    near, far = depths
    seen = [_seen_places(photo, camera, depths) for camera in cameras]
    places, crossings = (np.concatenate(parts) for parts in zip(*seen))
    farthest = float(np.abs(crossings).max())
    # Parallax of the nearest against the farthest per unit of length.
    parallax_px = photo.focal_px[0] * (1 / near - 1 / far)
    if parallax_px > 0:
        farthest = min(farthest, MAX_PARALLAX * max(photo.size) / parallax_px)
    step = max(farthest / FARTHEST_STEPS, MIN_STEP * near)
    steps = np.clip(crossings, -farthest, farthest) / step
    corners = [ViewOffset(float(y), float(x)) for x, y in (steps.min(axis=0), steps.max(axis=0))]
    return Reach(_margins(photo.size, places), step, tuple(outer_views(corners)) if parallax_px > 0 else ())


class FreeViews:
    """Makes views of one photo for cameras that are known in advance.

    scale_px: disparity of the views, times the depth in their camera.
    """

    def __init__(
        self,
        photo: FloatImage,
        inverse_depth: FloatImage,
        camera: Camera,
        cameras: Sequence[Camera],
        inpainter: Inpainter | None = fill_background,
        stages: Stages = ALL_STAGES,
    ) -> None:
        """Make the ray set.

        photo: (H, W, 3), sRGB-encoded, taken by `camera`, whose pictures are of this size. inverse_depth: (H, W),
        positive, 1 / depth. cameras: all cameras whose views will be made. inpainter: fills the surfaces that they
        disocclude, once for all views; None: each view fills its own holes, which is faster. stages: the ones that are
        on. Raises InputError for a camera that sees nothing of the photo.
        """
        reach = reach_of(camera, cameras, depths_of(inverse_depth))
        self._margins = margins = reach.margins if stages.outpainting else NO_MARGINS
        self.scale_px = camera.focal_px[0] * reach.step
        disparity = inverse_depth * np.float32(self.scale_px)
        self._step = rounding_step(disparity)
        colors, disparity = outpaint(photo, disparity, margins, stages)
        x, y = camera.centre_px
        self._camera = replace(camera, size=image_size(disparity), centre_px=(x + margins.left, y + margins.top))
        outer = reach.outer if inpainter is not None and stages.share_inpainted else ()
        self._rays = rays_of_photo(colors, disparity, farthest_views(reach.outer), len(outer), stages=stages)
        completing = update(self._rays, outer, Renderer(inpaint=inpainter or fill_background))
        for done, _ in enumerate(completing, 1):
            report_progress(done, len(outer), "what cameras may see beside the photo's surfaces")

    def view(self, camera: Camera) -> View:
        """Return the view of a camera; see `scale_px` for its disparity."""
        matrix = target_from_photo(self._camera, camera, self.scale_px)
        return render_free_view(self._rays, matrix, camera.size, self._margins, self._step)


def fitted_cameras(cameras: Sequence[Camera], given: int, size: ImageSize) -> list[Camera]:
    """Return the cameras with pictures scaled so that those of the given one have the photo's size.

    Raises InputError if its pictures have another shape than the photo.
    """
    scale = size.width / cameras[given].size.width
    if abs(size.height / (cameras[given].size.height * scale) - 1) > MAX_SHAPE_DIFFERENCE:
        raise InputError(
            f"{cameras[given].source}: its pictures are {cameras[given].size}, the photo is {size}; give its poses"
        )
    sizes = [ImageSize(*(max(round(side * scale), 1) for side in camera.size)) for camera in cameras]
    sizes[given] = size
    return [camera.resized(scaled) for camera, scaled in zip(cameras, sizes)]


def steered(camera: Camera, right: float, down: float, forward: float) -> Camera:
    """Return the camera, moved forward, in the world's units, and turned towards a place (right, down) of its picture.

    A place at 1 is on the border.
    """
    (height, width), (focal_x, focal_y) = camera.size, camera.focal_px
    yaw, pitch = atan(right * width / (2 * focal_x)), atan(down * height / (2 * focal_y))
    about_y = np.array([[cos(yaw), 0, sin(yaw)], [0, 1, 0], [-sin(yaw), 0, cos(yaw)]])
    about_x = np.array([[1, 0, 0], [0, cos(pitch), sin(pitch)], [0, -sin(pitch), cos(pitch)]])
    position = camera.position + forward * camera.world_from_camera[:, 2]
    return replace(camera, world_from_camera=camera.world_from_camera @ about_y @ about_x, position=position)


def _seen_places(photo: Camera, target: Camera, depths: tuple[float, float]) -> tuple[Points, Points]:
    """Return the places (N, 2) of the photo that a camera sees, and where it looks through the photo's plane (N, 2).

    The former are (x, y) in pixels, the latter in the world's units, for samples of its picture at both depths. Raises
    InputError if it sees nothing of the photo.
    """
    x, y = (np.linspace(-0.5, side - 0.5, SAMPLES_ACROSS) for side in target.size[::-1])
    pixels = np.stack([part.ravel() for part in (*np.meshgrid(x, y), np.ones((SAMPLES_ACROSS, SAMPLES_ACROSS)))])
    photo_from_world, size = photo.world_from_camera.T, np.array(photo.size[::-1])
    rays = photo_from_world @ target.world_from_camera @ (np.linalg.inv(target.intrinsics) @ pixels)
    origin = photo_from_world @ (target.position - photo.position)
    seen, crossed = [], []
    for depth in depths:
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (depth - origin[2]) / rays[2]
            points = origin[:, None] + along * rays
            at = (photo.intrinsics @ (points / depth))[:2].T
            crossing = (origin[:2, None] - origin[2] / rays[2] * rays[:2]).T
        is_ahead = along > 0
        is_near = is_ahead & (at > -MAX_BEYOND * size).all(axis=1) & (at < (1 + MAX_BEYOND) * size).all(axis=1)
        seen.append(at[is_ahead])
        crossed.append(crossing[is_near])
    places = np.concatenate(seen)
    if not ((places > -0.5) & (places < size - 0.5)).all(axis=1).any():
        raise InputError(f"{target.source}: sees nothing of the photo, which looks elsewhere; leave this pose out")
    return places, np.concatenate(crossed)


def _margins(size: ImageSize, places: Points) -> Margins:
    """Return the margins around a photo of (height, width) that hold these places (x, y), within MAX_BEYOND."""
    (left, top), (right, bottom) = -0.5 - places.min(axis=0), 0.5 + places.max(axis=0) - (size.width, size.height)

    def margin(reach_px: float, length: int) -> int:
        return ceil(min(reach_px + LOOKUP_MARGIN_PX, MAX_BEYOND * length)) if reach_px > MIN_BEYOND_PX else 0

    return Margins(
        margin(top, size.height), margin(bottom, size.height), margin(left, size.width), margin(right, size.width)
    )
