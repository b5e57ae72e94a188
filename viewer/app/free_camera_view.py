"""What a camera sees that left the plane of the views: a picture with its disparity, made in the background.

The renderer shows it in place of the field, so that aperture, focus, viewpoint and zoom go on as before. A draft comes
first, from a small copy of the photo; hidden areas are inpainted for the whole one, once, while nothing moves.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import photo_in_srgb
from iibr_core.method.disparity_range import measure_disparity_range
from iibr_core.runtime.work import Cancelled, watched
from iibr_core.scenes.scene import LoadedPhoto
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import (
    Camera,
    ImageSize,
    ViewUpdate,
    image_size,
)
from viewer.background.job_threads import Failed, Job, JobThread
from viewer.display.scene_view import SceneView
from viewer.gpu.refocus.frame_budget import stretch_image
from viewer.model.actions import Action, Notify
from viewer.model.free_camera import FORWARD_LIMITS, MOST_ASIDE, CameraProgress, FreeCamera, Poses
from viewer.model.state.app_state import AppState
from viewer.model.state.notices import Notice

if TYPE_CHECKING:
    from iibr_core.beyond.free_cameras import FreeViews

DRAFT_PIXELS = 40_000
"""Of the photo's copy that drafts are made of: they are there within a tenth of a second."""


@dataclass(frozen=True)
class FreeRequest:
    """What is to be drawn: of which photo, with the disparity of its centre view, by which camera."""

    loaded: LoadedPhoto
    centre: ViewUpdate
    poses: Poses | None
    camera: FreeCamera


@dataclass(frozen=True, eq=False)
class FreeView:
    """The view of a request's camera, as one of the scene's."""

    request: FreeRequest
    view: ViewUpdate
    is_draft: bool


FreeResult = FreeView | CameraProgress | Failed[FreeRequest]


@dataclass(frozen=True, eq=False)
class _Ready:
    """Views of a request's photo that are ready to be made. camera: the photo's; nearest: its distance, in the unit of
    the poses. inverse_depths, disparities: of the farthest and the nearest, one by the other.
    """

    request: FreeRequest
    views: FreeViews
    camera: Camera
    others: tuple[Camera, ...]
    nearest: float
    inverse_depths: tuple[float, float]
    disparities: tuple[float, float]

    def is_for(self, request: FreeRequest) -> bool:
        """Whether another camera is all that this asks for."""
        return replace(request, camera=self.request.camera) == self.request


class FreeCameraView:
    """Everything is called from the one GL thread. shown: whose view, no draft, stands in the picture's place."""

    def __init__(self, scene_view: SceneView, wake: Callable[[], None]) -> None:
        """wake: called, in the drawing thread, when a view is made."""
        self.shown: FreeRequest | None = None
        self._scene_view = scene_view
        self._worker: JobThread[FreeRequest, FreeResult] = JobThread("iibr-free", wake, self._draw, Failed)
        self._asked: FreeRequest | None = None
        self._may_interrupt = True
        self._ready: dict[bool, _Ready] = {}

    def advance(self, state: AppState) -> list[Action]:
        """Have drawn what is wanted, show what is there, and say what went wrong."""
        camera, loaded, centre = state.free_camera, self._scene_view.loaded, self._scene_view.centre
        if camera is None or loaded is None or centre is None or state.shows_before:
            return self._leave()
        actions = self._take()
        wanted = FreeRequest(loaded, centre, state.poses, camera)
        # A camera that goes on moving is seen to move: a draft at least of each request.
        if wanted != self._asked and self._may_interrupt:
            self._asked, self._may_interrupt = wanted, False
            self._worker.submit(wanted)
        return actions

    def close(self) -> None:
        """Stop drawing."""
        self._worker.close()

    def _leave(self) -> list[Action]:
        if self._asked is None:
            return []
        self._worker.cancel()
        self._scene_view.show_fallback(None)
        self._asked, self.shown, self._may_interrupt = None, None, True
        self._ready = {}  # a job that is still being cancelled keeps what it makes in the old one
        return [CameraProgress(None)]

    def _take(self) -> list[Action]:
        actions: list[Action] = []
        while (result := self._worker.next_result()) is not None:
            match result:
                case FreeView(request, view, is_draft):
                    self._scene_view.show_fallback(view)
                    self.shown, self._may_interrupt = None if is_draft else request, True
                case CameraProgress():
                    actions.append(result)
                case Failed(_, message):
                    self._may_interrupt = True
                    actions += [CameraProgress(None), Notify(Notice(message, is_error=True))]
        return actions

    def _draw(self, job: Job[FreeRequest, FreeResult]) -> Iterator[FreeResult]:
        """In the drawing thread. What a photo's views are made of is kept: the next picture is then drawn at once."""
        kept = self._ready
        with suppress(Cancelled):
            has_draft = math.prod(job.request.loaded.photo.size) > DRAFT_PIXELS
            for is_draft in (True, False) if has_draft else (False,):
                ready = kept.get(is_draft)
                if ready is None or not ready.is_for(job.request):
                    kept.pop(is_draft, None)  # two would be large
                    ready = kept[is_draft] = _make_ready(job, is_draft)
                yield FreeView(job.request, _view(job, ready), is_draft)
            yield CameraProgress(None)


def _make_ready(job: Job[FreeRequest, FreeResult], is_draft: bool) -> _Ready:
    """Raises InputError for poses that see nothing of the photo, Cancelled once the job should stop."""
    from iibr_core.beyond.free_cameras import (
        FreeViews,
        depths_of,
        fitted_cameras,
        inverse_depth_of,
        steered,
    )
    from iibr_core.inpainting.background import fill_background

    request = job.request
    photo, poses, disparity = photo_in_srgb(request.loaded.photo), request.poses, request.centre.disparity
    assert disparity is not None
    if poses is None:
        centre_px = (photo.size.width - 1) / 2, (photo.size.height - 1) / 2
        camera = Camera(np.eye(3), np.zeros(3), photo.size, (photo.focal_px,) * 2, centre_px, photo.name)
        others: tuple[Camera, ...] = ()
    else:
        others = tuple(fitted_cameras(poses.cameras, poses.given, photo.size))
        camera = others[poses.given]
    inverse_depth = inverse_depth_of(disparity, camera.depth_range)
    (nearest, farthest), span = depths_of(inverse_depth), measure_disparity_range(disparity)
    colors = photo.pixels
    if is_draft:
        size = _draft_size(photo.size)
        colors, inverse_depth, camera = _sampled(colors, size), _sampled(inverse_depth, size), camera.resized(size)
    asides = (-MOST_ASIDE, MOST_ASIDE)
    ways = [(right, down, forward * nearest) for right in asides for down in asides for forward in FORWARD_LIMITS]
    cameras = (*others, *(steered(camera, *way) for way in ways))
    with watched(lambda done, total, doing: job.post(CameraProgress(done / total))):
        views = FreeViews(colors, inverse_depth, camera, cameras, None if is_draft else fill_background)
    inverse_depths, disparities = (1 / farthest, 1 / nearest), (span.low, span.high)
    return _Ready(request, views, camera, others, nearest, inverse_depths, disparities)


def _view(job: Job[FreeRequest, FreeResult], ready: _Ready) -> ViewUpdate:
    """What the camera sees, with the size and the disparities of the scene's views."""
    from iibr_core.beyond.free_cameras import steered
    from iibr_core.method.light_field import encode_for_storage

    free, centre = job.request.camera, job.request.centre
    camera = ready.camera if free.pose is None else ready.others[free.pose].resized(ready.camera.size)
    camera = steered(camera, free.right, free.down, free.forward * ready.nearest)
    seen = ready.views.view(camera)
    far, near = ready.inverse_depths
    low, high = ready.disparities
    px = (high - low) / (near - far) if near > far else 0.0
    longer = camera.focal_px[0] / ready.camera.focal_px[0]
    disparity = longer * (low + px * (seen.disparity / ready.views.scale_px - far))
    size = ImageSize(*centre.colors.shape[:2])
    is_hdr = job.request.loaded.photo.is_hdr
    colors = encode_for_storage(seen.colors, is_hdr)
    if camera.size != size:
        shown_px = ScreenSize(size.width, size.height)
        colors = _sampled(colors, size) if is_hdr else stretch_image(colors.astype(np.uint8, copy=False), shown_px)
        disparity = _sampled(disparity, size)
    return replace(centre, colors=colors, disparity=disparity.astype(np.float32))


def _draft_size(size: ImageSize) -> ImageSize:
    smaller = math.sqrt(DRAFT_PIXELS / math.prod(size))
    return ImageSize(*(max(round(smaller * side), 1) for side in size))


def _sampled(image: NDArray[Any], size: ImageSize) -> NDArray[Any]:
    """An image (H, W, ...) at another size: of each pixel there the one that lies where it does."""
    rows, columns = (
        ((np.arange(there) + 0.5) * (here / there)).astype(int) for there, here in zip(size, image_size(image))
    )
    return np.ascontiguousarray(image[rows][:, columns])
