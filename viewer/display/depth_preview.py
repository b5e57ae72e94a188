"""Previews edits of the depth: the photo, warped by the edited disparity, in place of its views.

A preview is drawn if the edits of the state differ from those of the views on the screen.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from iibr_core.depth.editing.edits import DepthEdits
from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.scene import LoadedPhoto, Source, still_disparity
from iibr_core.types import FloatImage
from viewer.display.scene_view import SceneView
from viewer.model.app_state import AppState
from viewer.model.depth import current_settings

if TYPE_CHECKING:
    from iibr_core.depth.editing.canvas import DepthCanvas

MAX_STROKES = 8
"""Largest number of strokes that the window's thread paints for a frame."""


class DepthPreview:
    """Keeps a canvas of the open photo. Call it only from the thread of the GL context."""

    def __init__(self, scene_view: SceneView) -> None:
        self._scene_view = scene_view
        self._loaded: LoadedPhoto | None = None
        self._resumed: LoadedPhoto | None = None
        self._canvas: DepthCanvas | None = None
        self._generation = 0
        self._shown: DepthEdits | None = None
        self._still: tuple[DepthEdits, float] | None = None

    def forget(self) -> None:
        """Free the canvas, because another photo is open."""
        self._loaded = self._canvas = self._still = None

    def update(self, state: AppState) -> None:
        """Show the edits of this state if the screen shows others. Raises InputError if they make no sense."""
        loaded, scene = self._scene_view.loaded, state.scene
        if loaded is None or scene is None or scene.plan is None or self._scene_view.generation > state.generation:
            return
        if loaded is not self._loaded or self._scene_view.generation != self._generation:
            if self._loaded is None or loaded.refined is not self._loaded.refined:
                self._canvas = self._still = None
            self._loaded, self._generation = loaded, self._scene_view.generation
            self._shown = loaded.depth_settings.edits
        edits = current_settings(state).edits
        if edits == self._shown or scene.source is not state.source:
            return
        canvas = self._canvas_for(edits, loaded)
        if canvas.strokes_ahead(edits) <= MAX_STROKES:  # otherwise they show once the worker has painted them
            self._scene_view.show_disparity(self._field_disparity(canvas, edits, scene.source, scene.plan))
            self._shown = edits

    def _canvas_for(self, edits: DepthEdits, loaded: LoadedPhoto) -> DepthCanvas:
        from iibr_core.depth.editing.canvas import DepthCanvas

        self._canvas = self._canvas or DepthCanvas(loaded.photo.pixels, loaded.refined.values)
        if self._canvas.strokes_ahead(edits) > MAX_STROKES and self._resumed is not loaded:
            self._canvas.resume(loaded.depth_settings.edits, loaded.disparity.values)
            self._resumed = loaded
        return self._canvas

    def _field_disparity(self, canvas: DepthCanvas, edits: DepthEdits, source: Source, plan: ScenePlan) -> FloatImage:
        """Return the edited disparity in px per view step of the plan of the last views."""
        values = canvas.apply(edits)
        if self._still is None or self._still[0] != edits.tone:
            self._still = edits.tone, still_disparity(source, canvas.without_strokes(edits))
        scale = plan.disparity_scale or 1.0  # a flat scene has none yet
        return (values - np.float32(self._still[1])) * np.float32(scale)
