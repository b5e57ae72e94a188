"""Views of any cameras from one photo: from other places, turned, nearer, with lenses of their own.

The field around the photo's camera is as dense as can be: none of its views is kept, each ray of it is made when a
camera looks along it. Which part of its plane the cameras look through says how far the ray set has to be completed.
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
from iibr_core.inpainting.inpainter import Inpainter
from iibr_core.inpainting.outpainting import outpaint
from iibr_core.method.disparity_range import measure_disparity_range, rounding_step
from iibr_core.method.farthest_views import LOOKUP_MARGIN_PX, farthest_views, outer_views
from iibr_core.method.rays import NO_MARGINS, rays_of_photo
from iibr_core.method.update_loop import update
from iibr_core.method.view import Renderer, View
from iibr_core.runtime.work import report_progress
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.types import (
    Camera,
    FloatImage,
    ImageSize,
    InputError,
    Margins,
    ViewOffset,
    image_size,
)

FARTHEST_STEPS = 4.0
"""To the border of what cameras look through on the photo's plane: the length of a view step follows from it."""
MOST_BEYOND = 0.5
"""Of the photo's width and height: so far on each side it is continued for cameras that look there."""
LEAST_BEYOND_PX = 1e-3
MOST_PARALLAX = 0.5
"""Of the photo's longer side: where the nearest moves farther against the farthest, cameras see inpainted areas."""
MOST_UNLIKE = 0.02
"""So far the sides of a pose's picture and the photo's may differ in their ratio: smaller copies are rounded."""
LOOKED_AT = 33
"""So many places each way of a camera's picture tell what it sees."""

LEAST_STEP = 1e-6
"""Of the nearest's distance: of cameras that only turn, none looks beside the photo's place."""

Points = NDArray[np.float64]


def inverse_depth_of(disparity: FloatImage, depth_range: tuple[float, float] | None) -> FloatImage:
    """1 / depth (H, W) in the unit of lengths that depth_range is in, of disparity (H, W) in any unit.

    The range of the disparity becomes the range of depths. Where that is not known (None), lengths are in
    distances of the nearest, and what is infinitely far as `infinity_of` has it.
    """
    span = measure_disparity_range(disparity)
    if depth_range is None:
        at_infinity = infinity_of(span.low, span.high)
        farthest, nearest = (span.low - at_infinity) / (span.high - at_infinity), 1.0
    else:
        nearest, farthest = (1.0 / depth for depth in depth_range)
    # What is flat is at the middle of both.
    share = (np.clip(disparity, span.low, span.high) - span.low) / span.range if span.range > 0 else 0.5
    return np.full(disparity.shape, farthest + (nearest - farthest) * share, np.float32)


@dataclass(frozen=True)
class Reach:
    """What cameras ask of a photo. margins: so far beyond its frame they look. step: length of a view step, in the
    world's units. outer: views that show what they disocclude.
    """

    margins: Margins
    step: float
    outer: tuple[ViewOffset, ...]


def reach_of(photo: Camera, cameras: Sequence[Camera], depths: tuple[float, float]) -> Reach:
    """Of cameras that look at what lies between two depths before the photo's.

    Raises InputError for a camera that sees nothing of the photo.
    """
    near, far = depths
    looked_at = [_looked_at(photo, camera, depths) for camera in cameras]
    places, crossings = (np.concatenate(parts) for parts in zip(*looked_at))
    farthest = float(np.abs(crossings).max())
    # What the nearest moves against the farthest, for each unit of length.
    parallax_px = photo.focal_px[0] * (1 / near - 1 / far)
    if parallax_px > 0:
        farthest = min(farthest, MOST_PARALLAX * max(photo.size) / parallax_px)
    step = max(farthest / FARTHEST_STEPS, LEAST_STEP * near)
    steps = np.clip(crossings, -farthest, farthest) / step
    corners = [ViewOffset(float(y), float(x)) for x, y in (steps.min(axis=0), steps.max(axis=0))]
    return Reach(_margins(photo.size, places), step, tuple(outer_views(corners)) if parallax_px > 0 else ())


class FreeViews:
    """Makes views of one photo for cameras that are known from the start; each when it is asked for.

    scale_px: the disparity of its views times the distance from their cameras' planes.
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
        """photo: (H, W, 3) sRGB-encoded, taken by `camera`, which is of its size. inverse_depth: (H, W), positive, 1 /
        distance from the camera's plane. cameras: all that will be asked for. inpainter: fills what they disocclude,
        for all views alike; None leaves that to each view, which is a draft then. stages: that are on.

        Raises InputError for a camera that sees nothing of the photo.
        """
        reach = reach_of(camera, cameras, depths_of(inverse_depth))
        margins = reach.margins if stages.outpainting else NO_MARGINS
        self._margins = margins
        self.scale_px = camera.focal_px[0] * reach.step
        disparity = inverse_depth * np.float32(self.scale_px)
        self._step = rounding_step(disparity)
        farthest = farthest_views(reach.outer)
        colors, disparity = outpaint(photo, disparity, margins, stages)
        x, y = camera.centre_px
        centre_px = x + margins.left, y + margins.top
        self._camera = replace(camera, size=image_size(disparity), centre_px=centre_px)
        outer = reach.outer if inpainter is not None and stages.share_inpainted else ()
        self._rays = rays_of_photo(colors, disparity, farthest, len(outer), stages=stages)
        completing = update(self._rays, outer, Renderer(inpaint=inpainter or fill_background))
        for done, _ in enumerate(completing, 1):
            report_progress(done, len(outer), "what cameras may see beside the photo's surfaces")

    def view(self, camera: Camera) -> View:
        """Return the view of a camera; see `scale_px` for its disparity."""
        matrix = target_from_photo(self._camera, camera, self.scale_px)
        return render_free_view(self._rays, matrix, camera.size, self._margins, self._step)


def depths_of(inverse_depth: FloatImage) -> tuple[float, float]:
    """Of the nearest and the farthest."""
    return 1 / float(inverse_depth.max()), 1 / float(inverse_depth.min())


def fitted_cameras(cameras: Sequence[Camera], given: int, size: ImageSize) -> list[Camera]:
    """The cameras with pictures so much smaller or larger that those of the given one are of the photo's size.

    Raises InputError where they have another shape.
    """
    scale = size.width / cameras[given].size.width
    if abs(size.height / (cameras[given].size.height * scale) - 1) > MOST_UNLIKE:
        raise InputError(f"{cameras[given].source}: is of pictures of {cameras[given].size}, the photo is {size}")
    smaller = [ImageSize(*(max(round(side * scale), 1) for side in camera.size)) for camera in cameras]
    return [camera.resized(each) for camera, each in zip(cameras, [*smaller[:given], size, *smaller[given + 1 :]])]


def steered(camera: Camera, right: float, down: float, forward: float) -> Camera:
    """The camera moved forward, in the world's units, and turned towards the place (right, down) of its picture, where
    1 is the border.
    """
    (height, width), (focal_x, focal_y) = camera.size, camera.focal_px
    across, along = atan(right * width / (2 * focal_x)), atan(down * height / (2 * focal_y))
    about_y = np.array([[cos(across), 0, sin(across)], [0, 1, 0], [-sin(across), 0, cos(across)]])
    about_x = np.array([[1, 0, 0], [0, cos(along), sin(along)], [0, -sin(along), cos(along)]])
    position = camera.position + forward * camera.world_from_camera[:, 2]
    return replace(camera, world_from_camera=camera.world_from_camera @ about_y @ about_x, position=position)


def _looked_at(photo: Camera, target: Camera, depths: tuple[float, float]) -> tuple[Points, Points]:
    """Where the photo shows (N, 2) what a camera sees, and where that looks through the photo's plane (N, 2), in the
    world's units: (x, y) each, for places all over its picture and both depths.

    Raises InputError where it sees nothing of the photo.
    """
    x, y = (np.linspace(-0.5, side - 0.5, LOOKED_AT) for side in target.size[::-1])
    pixels = np.stack([part.ravel() for part in (*np.meshgrid(x, y), np.ones((LOOKED_AT, LOOKED_AT)))])
    photo_from_world = photo.world_from_camera.T
    rays = photo_from_world @ target.world_from_camera @ (np.linalg.inv(target.intrinsics) @ pixels)
    place = photo_from_world @ (target.position - photo.position)
    height, width = photo.size
    shown, crossed = [], []
    for depth in depths:
        with np.errstate(divide="ignore", invalid="ignore"):
            along = (depth - place[2]) / rays[2]
            points = place[:, None] + along * rays
            at = (photo.intrinsics @ (points / depth))[:2].T
            crossing = (place[:2, None] - place[2] / rays[2] * rays[:2]).T
        beyond = np.array([width, height]) * MOST_BEYOND
        before = along > 0
        inside = before & (at > -beyond).all(axis=1) & (at < beyond + np.array([width, height])).all(axis=1)
        shown.append(at[before])
        crossed.append(crossing[inside])
    places = np.concatenate(shown)
    if not ((places > -0.5) & (places < np.array([width, height]) - 0.5)).all(axis=1).any():
        raise InputError(f"{target.source}: sees nothing of the photo, which looks elsewhere; leave this pose out")
    return places, np.concatenate(crossed)


def _margins(size: ImageSize, places: Points) -> Margins:
    """So far beyond the frame of a photo of this size these places (x, y) lie."""
    (left, top), (right, bottom) = -0.5 - places.min(axis=0), 0.5 + places.max(axis=0) - (size.width, size.height)

    def margin(reach: float, length: int) -> int:
        return ceil(min(reach + LOOKUP_MARGIN_PX, MOST_BEYOND * length)) if reach > LEAST_BEYOND_PX else 0

    return Margins(
        margin(top, size.height), margin(bottom, size.height), margin(left, size.width), margin(right, size.width)
    )
