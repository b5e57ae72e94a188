"""The open scene from several viewpoints at once, woven into one picture for a screen: for both eyes, or for a lens."""

from __future__ import annotations

import time
from dataclasses import dataclass, replace

from iibr_core.beyond.picture_quality import QUALITY_LEVELS
from viewer.display.scene_view import VIEW_REFRESH_S, SceneView
from viewer.gpu.context import GLContext
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.refocus.frame_budget import OVERHEAD_S
from viewer.gpu.refocus.picture_renderer import Renderer
from viewer.gpu.render_targets import RenderTarget
from viewer.gpu.weaving import Weaver
from viewer.model.stereo import Weave

MAX_RENDERERS = 2
"""Largest number of pictures that are refined side by side; the targets of more would not fit the graphics card."""


@dataclass(frozen=True)
class WovenPicture:
    """Everything that a woven picture depends on. passes: shown so far; see `Picture` for the other numbers."""

    field: LightFieldTexture
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
        self._begun, self._complete, self._drawn_at = -1, 0, 0.0
        self.drawn: WovenPicture | None = None

    @property
    def screen(self) -> RenderTarget:
        """The woven picture."""
        assert self._weaver.screen is not None, "draw first"
        return self._weaver.screen

    @property
    def is_drawing(self) -> bool:
        """Whether the last picture can become better."""
        if self.drawn is not None and self._draws_in_turn:
            return self._complete < len(self.drawn.weave.eyes)
        return any(not renderer.is_converged for renderer in self._renderers)

    @property
    def _draws_in_turn(self) -> bool:
        return self.drawn is not None and len(self._renderers) < len(self.drawn.weave.eyes)

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
        picture = WovenPicture(view.renderer.drawn_field, view.views_uploaded, view.previews, weave)
        drawn = self.drawn
        if drawn is not None and replace(picture, views_uploaded=drawn.views_uploaded, passes=drawn.passes) == drawn:
            if self.shows_all_views:
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
        self.drawn, self._renderers = None, []

    def _begin(self, weave: Weave, budget_s: float) -> None:
        """Draw each picture as well as the time is expected to allow, all at one level of quality."""
        view, count = self._scene_view, len(weave.eyes)
        wanted = count if count <= MAX_RENDERERS else 1
        if len(self._renderers) != wanted:
            self.release()
            self._renderers = [Renderer(self._gl, view.renderer.programs) for _ in range(wanted)]
        for renderer in self._renderers:
            renderer.show(view.renderer.drawn_field)
        level, converged = None, 0
        self._weaver.prepare(weave)
        each_s = budget_s / count + (OVERHEAD_S if wanted < count else 0.0)
        for i in sorted(range(count), key=lambda i: i != count // 2):  # the middle one decides on the level
            renderer, eye = self._renderers[i % wanted], weave.eyes[i]
            if level is None or wanted == count:
                renderer.render_in_time(eye.optics, eye.size_px, each_s, eye.part, level)
            else:  # tens of measurements would take longer than the pictures
                renderer.render(eye.optics, renderer.shown_px, QUALITY_LEVELS[level], eye.part)
            level, converged = renderer.level, converged + renderer.is_converged
            self._present(i)
        self._begun, self._complete = -1, count if converged == count and level == 0 else 0
        self._weave(weave)

    def _refined(self, drawn: WovenPicture, budget_s: float) -> WovenPicture:
        """Continue the pictures; show a pass once every picture has it."""
        if self._draws_in_turn:
            self._refine_in_turn(drawn.weave, budget_s)
            is_behind = self.is_drawing
        else:
            unfinished = [renderer for renderer in self._renderers if not renderer.is_converged]
            passes = min(renderer.passes_shown for renderer in unfinished)
            next(renderer for renderer in unfinished if renderer.passes_shown == passes).refine(budget_s)
            is_behind = any(renderer.passes_shown == passes for renderer in unfinished)
        if is_behind:
            return drawn
        for i in range(0 if self._draws_in_turn else len(self._renderers)):
            self._present(i)
        self._weave(drawn.weave)
        self.drawn = replace(drawn, passes=drawn.passes + 1)
        return self.drawn

    def _refine_in_turn(self, weave: Weave, budget_s: float) -> None:
        """Draw pictures to their ends, one after the other, until the time is spent."""
        renderer, end = self._renderers[0], time.perf_counter() + budget_s
        while self._complete < len(weave.eyes):
            if self._begun < self._complete:
                self._begun, eye = self._complete, weave.eyes[self._complete]
                renderer.render(eye.optics, eye.size_px, part=eye.part)
            renderer.refine(max(end - time.perf_counter(), 0.0))
            if renderer.is_converged:
                self._present(self._complete)
                self._complete += 1
            if time.perf_counter() >= end:
                return

    def _present(self, index: int) -> None:
        """Write the latest state of a picture into the sheet."""
        renderer = self._renderers[index % len(self._renderers)]
        renderer.present(self._weaver.tile(index, renderer.shown_px))

    def _weave(self, weave: Weave) -> None:
        self._weaver.weave(weave, self._renderers[0].shown_px)
        self._gl.ctx.finish()
