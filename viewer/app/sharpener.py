"""Draws the visible part of the picture from the photo at its own size while nothing moves.

It replaces the picture from the views once it is ready, until anything changes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.exports.full_picture import FullPicture, encode_light, is_full
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.scenes.scene import LoadedPhoto
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB
from viewer.app.jobs import drawn
from viewer.background.newest import Failed, Newest, Post
from viewer.background.window_work import WindowWork
from viewer.display.scene_view import Picture, SceneView
from viewer.gpu.context import GLContext
from viewer.gpu.inspection_passes import InspectionPasses
from viewer.model import messages
from viewer.model.action import Action, do
from viewer.model.app_state import AppState
from viewer.model.messages import Notice

if TYPE_CHECKING:
    from iibr_core.beyond.full_size import LargePhoto

Pixels = NDArray[np.uint8]


class Sharpener:
    """Everything but `_make` is called from the GL thread. pixels: (H, W, 3) shown sharp, None without."""

    def __init__(self, gl: GLContext, scene_view: SceneView, wake: Callable[[], None]) -> None:
        """wake: called, in the thread that makes parts, when there is something to draw, or a part is ready."""
        self.pixels: Pixels | None = None
        self._scene_view = scene_view
        self._passes = InspectionPasses(gl.ctx, scene_view.renderer.programs)
        self._worker: Newest[FullPicture, Pixels] = Newest("iibr-sharp", self._make, wake)
        self._window_work = WindowWork(wake)
        self._kept: tuple[LoadedPhoto, LargePhoto] | None = None
        self._wanted: Picture | None = None
        self._texture: int | None = None
        self._refused: LoadedPhoto | None = None

    @property
    def is_drawing(self) -> bool:
        """Whether `advance` has something to draw."""
        return self._window_work.is_waiting

    def texture(self, picture: Picture) -> int | None:
        """Return the GL name of the sharp part (rows bottom-up) of this picture, None while there is none."""
        return self._texture if self._texture is not None and _key(picture) == self._wanted else None

    def advance(self, picture: Picture | None, state: AppState, is_resting: bool, budget_s: float) -> list[Action]:
        """Draw for about `budget_s`, request the visible part and report errors.

        is_resting: nothing moves, and nothing else is being drawn.
        """
        key = None if picture is None else _key(picture)
        if key != self._wanted:
            self._stop()
        if picture is None or state.zoom is None:
            self._kept = None
        elif is_resting and self._wanted is None and (request := self._request_of(picture, state)) is not None:
            self._wanted = key
            self._worker.submit(request)
        if is_resting:
            self._window_work.advance(budget_s)
        else:
            self._window_work.forget_stopped()
        return self._take()

    def close(self) -> None:
        """Stop drawing and free the texture."""
        self._stop()
        self._worker.close()
        self._window_work.forget_stopped()
        self._passes.release()

    def _make(self, request: FullPicture, post: Post[Pixels]) -> None:
        """Post the pixels of a part. Keeps the photo, so that the next part is drawn at once."""
        from iibr_core.exports.full_drawing import draw_full

        def draw(settings: RenderSettings) -> NDArray[Any]:
            return self._window_work.run(drawn(partial(self._scene_view.renderer.start_picture, settings)))

        def keep(photo: LargePhoto) -> None:
            self._kept = request.loaded, photo

        kept = self._kept
        photo = kept[1] if kept is not None and kept[0] is request.loaded else None
        light = draw_full(request, draw, photo, keep)
        post(encode_light(light, False, SRGB, request.scene.color_space))

    def _request_of(self, picture: Picture, state: AppState) -> FullPicture | None:
        """Return the request for the visible part, None if the photo has no more detail than the views."""
        scene, loaded = state.scene, self._scene_view.loaded
        if scene is None or scene.plan is None or loaded is None or scene.own_size is None or state.zoom is None:
            return None
        if state.free_camera is not None or loaded is self._refused:
            return None
        is_finer = picture.size_px.width / picture.part.width > scene.width
        if not is_finer or not is_full(scene, picture.optics, scene.own_size):
            return None
        return FullPicture(scene, scene.plan, loaded, picture.optics, ScreenSize(*picture.size_px), part=picture.part)

    def _take(self) -> list[Action]:
        result = self._worker.next_result()
        if isinstance(result, Failed):
            self._refused = self._scene_view.loaded  # it would fail again
            text = f"The photo's full detail cannot be shown. {result.message}"
            return [do(messages.notify, Notice(text, is_error=True))]
        if result is not None:
            self.pixels = result
            self._texture = self._passes.show("sharp", np.ascontiguousarray(result[::-1]))
        return []

    def _stop(self) -> None:
        self._worker.cancel()
        self._wanted = self._texture = self.pixels = None


def _key(picture: Picture) -> Picture:
    """Return the picture without the number of views and samples, which the sharp part does not depend on."""
    return replace(picture, views_uploaded=0, samples=0)
