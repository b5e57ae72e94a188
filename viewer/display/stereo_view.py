"""The open scene from several viewpoints at once, woven into one picture for a screen: for both eyes, or for a lens."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

from viewer.display.scene_view import VIEW_REFRESH_S, SceneView
from viewer.gpu.context import GLContext
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.refocus.picture_renderer import Renderer
from viewer.gpu.render_targets import RenderTarget
from viewer.gpu.weaving import Weaver
from viewer.model.state.stereo import Weave


@dataclass(frozen=True)
class WovenPicture:
    """Everything that a woven picture depends on. passes: shown so far; see `Picture` for the other numbers."""

    generation: int
    views_uploaded: int
    previews: int
    weave: Weave
    passes: int = 0


class StereoView:
    """Draws the scene of a `SceneView`. Call it only from the thread of its context.

    drawn: record of the last picture, None before the first.
    """

    def __init__(self, gl: GLContext, scene_view: SceneView) -> None:
        self._gl, self._scene_view = gl, scene_view
        self._weaver = Weaver(gl.ctx, scene_view.renderer.programs)
        self._renderers: list[Renderer] = []
        self._field: LightFieldTexture | None = None
        self._drawn_at = 0.0
        self.drawn: WovenPicture | None = None

    @property
    def screen(self) -> RenderTarget:
        """The woven picture."""
        assert self._weaver.screen is not None, "draw first"
        return self._weaver.screen

    @property
    def is_drawing(self) -> bool:
        """Whether the last picture can become better."""
        return any(not renderer.is_converged for renderer in self._renderers)

    @property
    def shows_all_views(self) -> bool:
        """Whether no view was uploaded since the last picture."""
        return self.drawn is None or self.drawn.views_uploaded == self._scene_view.views_uploaded

    def draw(self, weave: Weave, budget_s: float | None = None) -> WovenPicture | None:
        """Draw these pictures if anything has changed, or refine them; return their record, None without views.

        budget_s: time for that in seconds, None for that of a frame.
        """
        view, budget_s = self._scene_view, self._gl.frame_budget_s if budget_s is None else budget_s
        if view.views_uploaded == 0:
            return None
        picture = WovenPicture(view.generation, view.views_uploaded, view.previews, weave)
        drawn = self.drawn
        if drawn is not None and replace(picture, views_uploaded=drawn.views_uploaded, passes=drawn.passes) == drawn:
            if self._field is view.renderer.drawn_field and self.shows_all_views:
                return self._refined(drawn, budget_s) if self.is_drawing else drawn
            if time.perf_counter() - self._drawn_at < VIEW_REFRESH_S:
                return drawn
        self._begin(weave, budget_s)
        self._drawn_at, self.drawn = time.perf_counter(), picture
        return picture

    def release(self) -> None:
        """Free every GL object; a later picture makes new ones."""
        for renderer in self._renderers:
            renderer.release()
        self._weaver.release()
        self.drawn, self._field, self._renderers = None, None, []

    def _begin(self, weave: Weave, budget_s: float) -> None:
        """Draw each picture as well as the time is expected to allow, all at one level of quality."""
        view, count = self._scene_view, len(weave.eyes)
        if len(self._renderers) != count:
            self.release()
            self._renderers = [Renderer(self._gl, view.renderer) for _ in range(count)]
        self._field, level = view.renderer.drawn_field, None
        self._weaver.prepare(weave)
        for renderer, eye in zip(self._renderers, weave.eyes):
            renderer.render_in_time(eye.optics, weave.picture_px, budget_s / count, eye.part, level)
            level = renderer.level
        self._present(weave)

    def _refined(self, drawn: WovenPicture, budget_s: float) -> WovenPicture:
        """Continue a picture that is behind; show a pass once every picture has it."""
        unfinished = [renderer for renderer in self._renderers if not renderer.is_converged]
        passes = min(renderer.passes_shown for renderer in unfinished)
        next(renderer for renderer in unfinished if renderer.passes_shown == passes).refine(budget_s)
        if any(renderer.passes_shown == passes for renderer in unfinished):
            return drawn
        self._present(drawn.weave)
        self.drawn = replace(drawn, passes=drawn.passes + 1)
        return self.drawn

    def _present(self, weave: Weave) -> None:
        """Write the pictures as they are and weave them."""
        size_px = self._renderers[0].shown_px
        for i, renderer in enumerate(self._renderers):
            renderer.present(self._weaver.tile(i, size_px))
        self._weaver.weave(weave, size_px)
        self._gl.ctx.finish()
