"""Shows what the free camera sees: a picture with its disparity, made in the background.

The renderer shows it in place of the field, so aperture, focus, viewpoint and zoom keep working. A draft from a small
copy of the photo comes first; hidden areas of the whole photo are inpainted once, while nothing moves.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import product
from typing import TYPE_CHECKING

import numpy as np

from iibr_core.color import photo_in_srgb
from iibr_core.method.disparity_range import measure_disparity_range
from iibr_core.runtime.work import watched
from iibr_core.scenes.scene import LoadedPhoto
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import Camera, ImageSize, ViewUpdate
from viewer.background.newest import Failed, Finder, Newest, Post, noting
from viewer.display.scene_view import SceneView
from viewer.gpu.refocus.frame_budget import stretch_image
from viewer.model import viewpoint
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.viewpoint import FORWARD_LIMITS, MAX_ASIDE, FreeCamera

if TYPE_CHECKING:
    from iibr_core.beyond.free_cameras import FreeViews

DRAFT_PIXELS = 40_000
"""Pixels of the photo's copy for drafts, which take a tenth of a second."""


@dataclass(frozen=True)
class FreeRequest:
    """A photo, the disparity of its centre view, and the camera that looks at it."""

    loaded: LoadedPhoto
    centre: ViewUpdate
    camera: FreeCamera


@dataclass(frozen=True, eq=False)
class FreeView:
    """The view of a request's camera, in the form of the scene's views."""

    request: FreeRequest
    view: ViewUpdate
    is_draft: bool


@dataclass(frozen=True, eq=False)
class _Ready:
    """The photo of a request, ready to be seen by cameras.

    camera: the photo's. nearest: distance of the nearest surface. far: least inverse depth; low: field disparity there.
    px: field disparity per inverse depth.
    """

    request: FreeRequest
    views: FreeViews
    camera: Camera
    nearest: float
    far: float
    low: float
    px: float


class FreeCameraView:
    """Keeps the free camera's view on the screen; called from the GL thread.

    shown: the request whose final view is on the screen, None while there is none.
    """

    def __init__(self, scene_view: SceneView, wake: Callable[[], None]) -> None:
        """wake: called, in the drawing thread, when a view is made."""
        self.shown: FreeRequest | None = None
        self._scene_view = scene_view
        self._asked: FreeRequest | None = None
        self._may_interrupt = True
        self._ready: dict[bool, _Ready] = {}
        newest: Newest[FreeRequest, FreeView | Action] = Newest("iibr-free", self._draw, wake)
        self._finder = Finder(newest, self._request, self._take, self._fail)
        self.close = self._finder.close

    def advance(self, state: AppState) -> list[Action]:
        """Request the camera's view, show results and report errors."""
        actions = self._finder.advance(state)
        has_left = self._asked is None and state.free_progress is not None
        return [*actions, do(viewpoint.report_camera, None)] if has_left else actions

    def _request(self, state: AppState) -> FreeRequest | None:
        """Return the request of the camera. Each shows a draft at least, so a moving camera is seen to move."""
        camera, loaded, centre = state.free_camera, self._scene_view.loaded, self._scene_view.centre
        if camera is None or loaded is None or centre is None or state.shows_before:
            self._scene_view.show_fallback(None)
            self._asked, self.shown, self._may_interrupt = None, None, True
            self._ready = {}  # a request that is being cancelled keeps its results in the old one
            return None
        wanted = FreeRequest(loaded, centre, camera)
        if wanted != self._asked and self._may_interrupt:
            self._asked, self._may_interrupt = wanted, False
        return self._asked

    def _take(self, result: FreeView | Action) -> list[Action]:
        if isinstance(result, Action):
            return [result]
        self._scene_view.show_fallback(result.view)
        self.shown, self._may_interrupt = None if result.is_draft else result.request, True
        return []

    def _fail(self, failed: Failed[FreeRequest]) -> list[Action]:
        self._may_interrupt = True
        return noting(do(viewpoint.report_camera, None))(failed)

    def _draw(self, request: FreeRequest, post: Post[FreeView | Action]) -> None:
        """Post a draft and the view. The prepared photo is kept, so the next view is made at once."""
        kept = self._ready
        has_draft = math.prod(request.loaded.photo.size) > DRAFT_PIXELS
        for is_draft in (True, False) if has_draft else (False,):
            ready = kept.get(is_draft)
            if ready is None or replace(ready.request, camera=request.camera) != request:
                kept.pop(is_draft, None)  # frees its memory first
                with watched(lambda done, total, doing: post(do(viewpoint.report_camera, done / total))):
                    ready = kept[is_draft] = _make_ready(request, is_draft)
            post(FreeView(request, _view(request, ready), is_draft))
        post(do(viewpoint.report_camera, None))


def _make_ready(request: FreeRequest, is_draft: bool) -> _Ready:
    """Return the photo with all that cameras within the limits see. Raises Cancelled."""
    from iibr_core.beyond.free_cameras import FreeViews, depths_of, inverse_depth_of, steered
    from iibr_core.formats.maps.resample import nearest_pixels
    from iibr_core.inpainting.background import fill_background

    photo, disparity = photo_in_srgb(request.loaded.photo), request.centre.disparity
    assert disparity is not None
    centre_px = (photo.size.width - 1) / 2, (photo.size.height - 1) / 2
    camera = Camera(np.eye(3), np.zeros(3), photo.size, (photo.focal_px,) * 2, centre_px, photo.name)
    inverse_depth, colors = inverse_depth_of(disparity, None), photo.pixels
    (nearest, farthest), span = depths_of(inverse_depth), measure_disparity_range(disparity)
    if is_draft:
        smaller = math.sqrt(DRAFT_PIXELS / math.prod(photo.size))
        size = ImageSize(*(max(round(smaller * side), 1) for side in photo.size))
        colors, inverse_depth = nearest_pixels(colors, size), nearest_pixels(inverse_depth, size)
        camera = camera.resized(size)
    limits = product((-MAX_ASIDE, MAX_ASIDE), (-MAX_ASIDE, MAX_ASIDE), FORWARD_LIMITS)
    corners = [steered(camera, right, down, step * nearest) for right, down, step in limits]
    views = FreeViews(colors, inverse_depth, camera, corners, None if is_draft else fill_background)
    px = (span.high - span.low) / (1 / nearest - 1 / farthest) if farthest > nearest else 0.0
    return _Ready(request, views, camera, nearest, 1 / farthest, span.low, px)


def _view(request: FreeRequest, ready: _Ready) -> ViewUpdate:
    """Return what the camera sees, with the size and the disparities of the scene's views."""
    from iibr_core.beyond.free_cameras import steered
    from iibr_core.formats.maps.resample import nearest_pixels
    from iibr_core.method.light_field import encode_for_storage

    free, centre = request.camera, request.centre
    seen = ready.views.view(steered(ready.camera, free.right, free.down, free.forward * ready.nearest))
    disparity = ready.low + ready.px * (seen.disparity / ready.views.scale_px - ready.far)
    size = ImageSize(*centre.colors.shape[:2])
    is_hdr = request.loaded.photo.is_hdr
    colors = encode_for_storage(seen.colors, is_hdr)
    if ready.camera.size != size:
        if is_hdr:
            colors = nearest_pixels(colors, size)
        else:
            colors = stretch_image(colors.astype(np.uint8, copy=False), ScreenSize(size.width, size.height))
        disparity = nearest_pixels(disparity, size)
    return replace(centre, colors=colors, disparity=disparity.astype(np.float32))
