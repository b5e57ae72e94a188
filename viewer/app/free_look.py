"""What a camera sees that left the plane of the views, drawn in the background; it stands in the picture's place.

One picture at a time: the next is what is wanted when the one before is there, so that a moving camera is seen to move.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from iibr_core.runtime.tiling import Cancelled
from iibr_core.types import Camera, ImageSize
from viewer.background.jobs import Failed, Job, JobThread
from viewer.background.loaded_photo import LoadedPhoto
from viewer.display.scene_view import SceneView
from viewer.gpu.context import GLContext
from viewer.gpu.inspection_passes import InspectionPasses
from viewer.model.actions import Action, Notify
from viewer.model.free_camera import FORWARD_LIMITS, MOST_ASIDE, FreeCamera, Poses
from viewer.model.layout import Rect, ScreenSize
from viewer.model.state.app_state import AppState, Picture
from viewer.model.state.notices import Notice

if TYPE_CHECKING:
    from iibr_core.generation.free_views import FreeViews

PREPARING = "Making ready to look around: this takes a moment, once for each photo."


@dataclass(frozen=True)
class FreePicture:
    """What is to be drawn: of which photo, by which camera, how large, and what part of it."""

    loaded: LoadedPhoto
    poses: Poses | None
    camera: FreeCamera
    size_px: ScreenSize
    part: Rect


@dataclass(frozen=True, eq=False)
class FreePixels:
    """A picture, drawn: (height, width, 3), sRGB-encoded."""

    picture: FreePicture
    pixels: NDArray[np.uint8]


@dataclass(frozen=True, eq=False)
class _Ready:
    """Views of a photo that are ready to be made. nearest: its distance, in the unit of the poses."""

    loaded: LoadedPhoto
    poses: Poses | None
    views: FreeViews
    camera: Camera
    others: tuple[Camera, ...]
    nearest: float


class FreeLook:
    """Everything is called from the one GL thread. shown: what `texture` shows, pixels: of it; None without."""

    def __init__(self, gl: GLContext, scene_view: SceneView, wake: Callable[[], None]) -> None:
        """wake: called, in the drawing thread, when a picture is drawn."""
        self.shown: FreePicture | None = None
        self.pixels: NDArray[np.uint8] | None = None
        self._scene_view = scene_view
        self._passes = InspectionPasses(gl.ctx, scene_view.renderer.programs)
        self._worker: JobThread[FreePicture, FreePixels | Failed[FreePicture]] = JobThread(
            "iibr-free", wake, self._draw, Failed
        )
        self._asked: FreePicture | None = None
        self._refused: FreePicture | None = None
        self._texture = 0
        self._ready: _Ready | None = None

    def texture(self, state: AppState) -> int | None:
        """GL name of what the free camera sees (rows bottom-up); None where there is none, or nothing yet."""
        is_current = self.shown is not None and self.shown.loaded is self._scene_view.loaded
        return self._texture if is_current and state.free_camera is not None else None

    def advance(self, picture: Picture | None, state: AppState) -> list[Action]:
        """Have drawn what is wanted, and say what went wrong."""
        camera, loaded = state.free_camera, self._scene_view.loaded
        if picture is None or camera is None or loaded is None:
            if self._asked is not None:
                self._worker.cancel()
            self._asked = self._refused = self.shown = self.pixels = None
            return []
        actions = self._take()
        wanted = FreePicture(loaded, state.poses, camera, picture.size_px, picture.part)
        if self._asked is None and wanted not in (self.shown, self._refused):
            self._asked = wanted
            self._worker.submit(wanted)
            if self._ready is None or self._ready.loaded is not loaded:
                actions.append(Notify(Notice(PREPARING)))
        return actions

    def close(self) -> None:
        """Stop drawing and free the texture."""
        self._worker.close()
        self._passes.release()

    def _take(self) -> list[Action]:
        result = self._worker.next_result()
        match result:
            case FreePixels(picture, pixels):
                self._asked, self.shown, self.pixels = None, picture, pixels
                self._texture = self._passes.show("free", np.ascontiguousarray(pixels[::-1]))
            case Failed(picture, message):
                self._asked, self._refused = None, picture
                return [Notify(Notice(message, is_error=True))]
        return []

    def _draw(self, job: Job[FreePicture, FreePixels | Failed[FreePicture]]) -> Iterator[FreePixels]:
        """In the drawing thread. What a photo's views are made of is kept: the next picture is then drawn at once."""
        from iibr_core.color import bytes_from_encoded

        with suppress(Cancelled):
            picture, ready = job.request, self._ready
            if ready is None or ready.loaded is not picture.loaded or ready.poses is not picture.poses:
                ready = self._ready = _make_ready(picture, job.should_stop)
            view = ready.views.view(_camera_of(picture, ready), job.should_stop)
            yield FreePixels(picture, bytes_from_encoded(view.colors))


def _make_ready(picture: FreePicture, should_stop: Callable[[], bool]) -> _Ready:
    """Raises InputError for poses that see nothing of the photo, Cancelled once should_stop is true."""
    from iibr_core.color import photo_in_srgb
    from iibr_core.generation.free_views import FreeViews, depths_of, fitted_cameras, inverse_depth_of, steered

    photo, poses = photo_in_srgb(picture.loaded.photo), picture.poses
    if poses is None:
        centre_px = (photo.size.width - 1) / 2, (photo.size.height - 1) / 2
        camera = Camera(np.eye(3), np.zeros(3), photo.size, (photo.focal_px,) * 2, centre_px, photo.name)
        others: tuple[Camera, ...] = ()
    else:
        others = tuple(fitted_cameras(poses.cameras, poses.given, photo.size))
        camera = others[poses.given]
    inverse_depth = inverse_depth_of(picture.loaded.disparity.values, camera.depth_range)
    nearest = depths_of(inverse_depth)[0]
    asides = (-MOST_ASIDE, MOST_ASIDE)
    ways = [(right, down, forward * nearest) for right in asides for down in asides for forward in FORWARD_LIMITS]
    cameras = (*others, *(steered(camera, *way) for way in ways))
    views = FreeViews(photo.pixels, inverse_depth, camera, cameras, should_stop)
    return _Ready(picture.loaded, poses, views, camera, others, nearest)


def _camera_of(picture: FreePicture, ready: _Ready) -> Camera:
    """With pictures just as large as the part of the window's."""
    from iibr_core.generation.free_views import steered

    free, part, size = picture.camera, picture.part, picture.size_px
    camera = ready.camera if free.pose is None else ready.others[free.pose]
    camera = steered(camera, free.right, free.down, free.forward * ready.nearest)
    whole = camera.resized(ImageSize(max(round(size.height / part.height), 1), max(round(size.width / part.width), 1)))
    x, y = whole.centre_px
    centre_px = x - part.x * whole.size.width, y - part.y * whole.size.height
    return replace(whole, size=ImageSize(size.height, size.width), centre_px=centre_px)
