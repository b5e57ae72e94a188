"""The part of the picture that is seen, drawn again from the photo at its own size while nothing moves.

It takes the place of the one drawn from the views as soon as it is there, and gives it back when anything changes.
"""

from __future__ import annotations

from collections.abc import Callable, Generator
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.exports.full_picture import FullPicture, is_full
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.scenes.scene import LoadedPhoto
from iibr_core.scenes.screen_size import ScreenSize
from viewer.background.job_threads import Failed
from viewer.background.sharpening import SharpeningWorker, SharpPart
from viewer.display.scene_view import SceneView
from viewer.gpu.context import GLContext
from viewer.gpu.inspection_passes import InspectionPasses
from viewer.model.actions import Action, Notify
from viewer.model.state.app_state import AppState, Picture
from viewer.model.state.notices import Notice


class Sharpener:
    """Everything is called from the one GL thread. pixels: what is shown sharp, None without."""

    def __init__(self, gl: GLContext, scene_view: SceneView, wake: Callable[[], None]) -> None:
        """wake: called, in the thread that makes parts, when there is something to draw, or a part is drawn."""
        self.pixels: NDArray[np.uint8] | None = None
        self._scene_view = scene_view
        self._passes = InspectionPasses(gl.ctx, scene_view.renderer.programs)
        self._worker = SharpeningWorker(wake, self._draw)
        self._wanted: Picture | None = None
        self._texture: int | None = None
        self._refused: LoadedPhoto | None = None

    @property
    def is_drawing(self) -> bool:
        """Whether `advance` has something to draw here."""
        return self._worker.window_work.is_waiting

    def texture(self, picture: Picture) -> int | None:
        """GL name of the sharp part (rows bottom-up) that takes the place of this picture; None while there is none."""
        return self._texture if self._texture is not None and _key(picture) == self._wanted else None

    def advance(self, picture: Picture | None, state: AppState, is_resting: bool, budget_s: float) -> list[Action]:
        """Draw what is to be drawn here, for about that long, have the rest made, and say what went wrong.

        is_resting: nothing moves, and nothing else is being drawn.
        """
        key = None if picture is None else _key(picture)
        if key != self._wanted:
            self._stop()
        if picture is None or state.zoom is None:
            self._worker.forget()
        request = self._request_of(picture, state) if picture is not None and is_resting else None
        if self._wanted is None and request is not None:
            self._wanted = key
            self._worker.submit(request)
        if is_resting:
            self._worker.window_work.advance(budget_s)
        else:
            self._worker.window_work.forget_stopped()
        return self._take()

    def close(self) -> None:
        """Stop drawing and free the texture."""
        self._stop()
        self._worker.close()
        self._worker.window_work.forget_stopped()
        self._passes.release()

    def _draw(self, settings: RenderSettings) -> Generator[None, None, NDArray[Any]]:
        """Draw a tile, a step at a time."""
        drawing = self._scene_view.renderer.start_picture(settings)
        try:
            while not drawing.is_done:
                drawing.advance(budget_s=0.0)
                yield
        finally:
            drawing.stop()
        return drawing.image

    def _request_of(self, picture: Picture, state: AppState) -> FullPicture | None:
        """None where the photo has no more to show than the views."""
        scene, loaded = state.scene, self._scene_view.loaded
        if scene is None or scene.plan is None or loaded is None or scene.own_size is None or state.zoom is None:
            return None
        if state.free_camera is not None:
            return None
        is_finer = picture.size_px.width / picture.part.width > scene.width
        if not is_finer or loaded is self._refused or not is_full(scene, picture.optics, scene.own_size):
            return None
        return FullPicture(scene, scene.plan, loaded, picture.optics, ScreenSize(*picture.size_px), part=picture.part)

    def _take(self) -> list[Action]:
        result = self._worker.next_result()
        match result:
            case SharpPart(pixels):
                self.pixels = pixels
                self._texture = self._passes.show("sharp", np.ascontiguousarray(pixels[::-1]))
            case Failed():
                self._refused = self._scene_view.loaded  # it would fail again
                return [Notify(Notice(f"Not shown at the photo's own pixels. {result.message}", is_error=True))]
        return []

    def _stop(self) -> None:
        self._worker.cancel()
        self._wanted = self._texture = self.pixels = None


def _key(picture: Picture) -> Picture:
    """What the sharp part depends on: not on how many views there are, nor how far they have come."""
    return replace(picture, views_uploaded=0, samples=0)
