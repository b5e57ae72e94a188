"""The open scene from several viewpoints at once, woven into one picture for a screen: for both eyes, or for a lens."""

from __future__ import annotations

import math
import time
from dataclasses import dataclass, replace

from iibr_core.beyond.picture_quality import BEST_QUALITY, QUALITY_LEVELS, QualityLevel
from iibr_core.scenes.screen_size import ScreenSize
from viewer.display.scene_view import VIEW_REFRESH_S, SceneView
from viewer.gpu.context import GLContext
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.refocus.accumulation import Accumulator
from viewer.gpu.refocus.frame_budget import FrameTimeModel, choose_quality_level, fetches_of, scale_size
from viewer.gpu.refocus.passes import ProgressiveAccumulation
from viewer.gpu.refocus.picture_lens import Lens, lens_of
from viewer.gpu.render_targets import RenderTarget, TargetCache
from viewer.gpu.weaving import Weaver
from viewer.model.state.stereo import Eye, Weave


@dataclass(frozen=True)
class WovenPicture:
    """Everything that a woven picture depends on. passes: drawn so far; see `Picture` for the other numbers."""

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
        programs = scene_view.renderer.programs
        self._accumulator, self._weaver = Accumulator(gl.ctx, programs), Weaver(gl.ctx, programs)
        self._frame_time, self._level = FrameTimeModel(gl.seconds_per_fetch), 0
        self._refining_s = 4 * gl.seconds_per_fetch
        self._field: LightFieldTexture | None = None
        self._pictures: list[ProgressiveAccumulation] = []
        self._targets: list[TargetCache] = []
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
        return any(not picture.is_complete for picture in self._pictures)

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
        is_same_field = self._field is view.renderer.drawn_field
        drawn = self.drawn
        if drawn is not None and replace(picture, views_uploaded=drawn.views_uploaded, passes=drawn.passes) == drawn:
            if is_same_field and self.shows_all_views:
                return self._refined(drawn, budget_s) if self.is_drawing else drawn
            if time.perf_counter() - self._drawn_at < VIEW_REFRESH_S:
                return drawn
        self._begin(weave, budget_s)
        self._drawn_at, self.drawn = time.perf_counter(), picture
        return picture

    def release(self) -> None:
        """Free every GL object; a later picture makes new ones."""
        self._take_targets(0)
        self._weaver.release()
        self.drawn, self._field, self._pictures = None, None, []

    def close(self) -> None:
        """Free the programs' buffers, too."""
        self.release()
        self._accumulator.release()

    def _take_targets(self, count: int) -> None:
        """Keep as many targets as there are pictures."""
        for cache in self._targets[count:]:
            cache.release()
        more = (TargetCache(self._gl.ctx) for _ in range(count - len(self._targets)))
        self._targets = [*self._targets[:count], *more]

    def _begin(self, weave: Weave, budget_s: float) -> None:
        """Draw a first pass of each picture, as well as the time is expected to allow."""
        self._field, start = self._scene_view.renderer.drawn_field, time.perf_counter()
        programs = self._scene_view.renderer.programs
        compiled = len(programs)
        self._take_targets(len(weave.eyes))
        self._weaver.prepare(weave)
        self._level = choose_quality_level(
            lambda level: self._fetches(weave, level), self._frame_time, budget_s, self._level
        )
        level = QUALITY_LEVELS[self._level]
        self._pictures = [self._picture(eye, weave, level) for eye in weave.eyes]
        for i in range(len(self._pictures)):
            self._sum_up(i, math.inf)
        self._present(weave)
        seconds = time.perf_counter() - start
        if len(programs) == compiled:  # compiling says nothing about drawing
            self._frame_time.learn(self._fetches(weave, level), seconds)
        drawn = sum(picture.done * math.prod(picture.size_px) for picture in self._pictures)
        self._refining_s = seconds / max(drawn, 1)
        if level != BEST_QUALITY:
            self._pictures = [self._picture(eye, weave, BEST_QUALITY) for eye in weave.eyes]

    def _refined(self, drawn: WovenPicture, budget_s: float) -> WovenPicture:
        """Continue the picture that is behind; show a pass once every picture has it."""
        index, behind = min(
            (item for item in enumerate(self._pictures) if not item[1].is_complete), key=lambda item: item[1].pass_index
        )
        before = behind.pass_index
        self._sum_up(index, budget_s)
        self._gl.ctx.finish()
        if any(picture.pass_index == before and not picture.is_complete for picture in self._pictures):
            return drawn
        self._present(drawn.weave)
        self.drawn = replace(drawn, passes=drawn.passes + 1)
        return self.drawn

    def _sum_up(self, index: int, budget_s: float) -> None:
        """Draw the next pass of a picture, or as much of it as there is time for."""
        picture, field = self._pictures[index], self._field
        assert field is not None
        targets = self._targets[index].get(picture.size_px)
        sample_s = self._refining_s * math.prod(picture.size_px)
        self._accumulator.sum_up(field, picture, targets, picture.pass_index + 1, budget_s, sample_s)

    def _present(self, weave: Weave) -> None:
        """Write the pictures as they are and weave them."""
        size_px = self._pictures[0].size_px
        for i, picture in enumerate(self._pictures):
            targets = self._targets[i].get(size_px)
            self._accumulator.passes.present(picture.lens, targets, into=self._weaver.tile(i, size_px))
        self._weaver.weave(weave, size_px)
        self._gl.ctx.finish()

    def _picture(self, eye: Eye, weave: Weave, level: QualityLevel) -> ProgressiveAccumulation:
        assert self._field is not None
        size_px = scale_size(weave.picture_px, level.scale)
        lens = self._lens(eye, size_px, level)
        return ProgressiveAccumulation(lens, size_px, lens.pass_count(self._field))

    def _lens(self, eye: Eye, size_px: ScreenSize, level: QualityLevel) -> Lens:
        assert self._field is not None
        lens = lens_of(eye.optics, self._field, round(size_px.width / eye.part.width), level)
        return replace(lens, part=eye.part)

    def _fetches(self, weave: Weave, level: QualityLevel) -> float:
        assert self._field is not None
        size_px = scale_size(weave.picture_px, level.scale)
        samples = sum(self._lens(eye, size_px, level).sample_count(self._field) for eye in weave.eyes)
        return fetches_of(samples, math.prod(size_px), bool(self._field.has_disparity.any()))
