"""Draws a light field through a virtual lens: at once as well as the time allows, then better until nothing changes.

Everything a picture depends on is a uniform, so a change of focus, aperture or eye costs one drawing and nothing else.
"""

from __future__ import annotations

import math
import time
from dataclasses import replace
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import Optics
from iibr_core.exports.render_settings import LensTile, RenderSettings
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import (
    SRGB,
    ColorSpace,
    FloatImage,
    GridShape,
    StoredColors,
    ViewUpdate,
)
from viewer.gpu.context import GLContext
from viewer.gpu.light_field_texture import Box, LightFieldTexture
from viewer.gpu.programs import ProgramCache
from viewer.gpu.refocus.accumulation import Accumulator, ProgressiveAccumulation
from viewer.gpu.refocus.frame_budget import (
    BEST_QUALITY,
    QUALITY_LEVELS,
    DrawCost,
    FrameTimeModel,
    QualityLevel,
    choose_quality_level,
    scale_size,
    stretch_image,
)
from viewer.gpu.refocus.picture_drawing import PictureDrawing
from viewer.gpu.refocus.picture_lens import lens_of
from viewer.gpu.refocus.screen_image import ScreenImage
from viewer.model.state.app_state import DrawReport

if TYPE_CHECKING:
    from iibr_core.gloss.shading import GlossMaps


class Renderer:
    """Draws one light field at a time. Call it only from the thread its context belongs to.

    report: what is known of the picture drawn last. passes_shown: how many passes of the best picture what is shown is
    made of; 0: it is softer than that. field: None before the first.
    """

    def __init__(self, gl: GLContext) -> None:
        self.gl = gl
        self.ctx = gl.ctx
        self.report = DrawReport()
        self.passes_shown = 0
        self.programs = ProgramCache(self.ctx)
        self._accumulator = Accumulator(self.ctx, self.programs)
        self.field: LightFieldTexture | None = None
        self._fallback_view: LightFieldTexture | None = None
        self._screen = ScreenImage(self.ctx)
        self._accumulation: ProgressiveAccumulation | None = None
        self._shown_from_pass = 0
        self._frame_time = FrameTimeModel(gl.seconds_per_fetch)
        self._refining_s = 4 * gl.seconds_per_fetch
        self._level = 0

    @property
    def drawn_field(self) -> LightFieldTexture:
        """What is drawn: the field, or what stands in for it. Raises ValueError before the first."""
        return self._fallback_view or self._loaded

    @property
    def _loaded(self) -> LightFieldTexture:
        if self.field is None:
            raise ValueError("no light field is open")
        return self.field

    def open_field(
        self,
        grid: GridShape,
        width: int,
        height: int,
        hdr: bool,
        with_disparity: bool,
        color_space: ColorSpace = SRGB,
    ) -> None:
        """Start an empty light field of this size in place of the one before. color_space: of its views.

        Raises InputError if the graphics driver cannot hold it; the field before then stays.
        """
        field = LightFieldTexture(self.ctx, grid, width, height, hdr, with_disparity)
        if self.field is not None:
            self.field.release()
        field.color_space = color_space
        self.field = field
        self._accumulation = None

    def upload_view(self, row: int, column: int, colors: StoredColors, disparity: FloatImage | None) -> None:
        """Add or replace one view; see LightFieldTexture.upload."""
        self._loaded.upload(row, column, colors, disparity)

    def change_disparity(self, row: int, column: int, disparity: FloatImage, box: Box) -> None:
        """Replace the disparity of the view uploaded last; see LightFieldTexture.change_disparity."""
        self._loaded.change_disparity(row, column, disparity, box)
        if not self.is_renewing:
            self._accumulation = None

    def show_fallback(self, view: ViewUpdate | None) -> None:
        """Draw this view alone in the field's place, from its middle; None: the field again.

        It has the size of the field's views, a disparity, and sRGB's colours.
        """
        if self._fallback_view is not None:
            self._fallback_view.release()
            self._fallback_view = None
        if view is not None:
            field = self._loaded
            size = field.width, field.height, field.hdr
            self._fallback_view = LightFieldTexture(self.ctx, field.grid, *size, with_disparity=True, is_single=True)
            self._fallback_view.upload(*field.grid.centre, view.colors, view.disparity)
        self._accumulation = None

    def set_gloss(self, maps: GlossMaps | None) -> None:
        """Use these maps for optics with gloss; None if there are none."""
        self._loaded.set_gloss(maps)
        self._accumulation = None

    def render(
        self,
        optics: Optics,
        size_px: ScreenSize,
        level: QualityLevel = BEST_QUALITY,
        part: Rect = WHOLE,
    ) -> None:
        """Draw the picture (`image_texture`, `read_image`) at once, with every view the aperture sees.

        level: what to leave out, except for its scale. part: what of the picture is drawn, stretched to size_px =
        (width, height). Before the first view the picture is black. Its framebuffer stays bound.
        """
        self._accumulation, self._shown_from_pass = self._accumulation_of(optics, size_px, level, part), 0
        self._draw(math.inf, passes=1)
        self._finish()

    def render_in_time(
        self,
        optics: Optics,
        size_px: ScreenSize,
        budget_s: float,
        part: Rect = WHOLE,
    ) -> None:
        """Draw the picture as well as the time is thought to allow; `refine` then makes it better.

        Its own image may then be smaller than size_px. part: what of the picture is drawn, stretched to size_px.
        """
        start = time.perf_counter()
        programs_before = len(self.programs)
        self._level = choose_quality_level(
            partial(self._work, optics, size_px, part), self._frame_time, budget_s, self._level
        )
        level = QUALITY_LEVELS[self._level]
        self.render(optics, scale_size(size_px, level.scale), level=level, part=part)
        self.ctx.finish()
        seconds = time.perf_counter() - start
        if len(self.programs) == programs_before:
            self._frame_time.learn(self._work(optics, size_px, part, level), seconds)
        drawn = self._current().done
        self._refining_s = seconds / max(drawn, 1) / math.prod(self._current().size_px)
        if level != BEST_QUALITY:
            self._accumulation = self._accumulation_of(optics, size_px, BEST_QUALITY, part)
            self.passes_shown = 0
        self._learn(drawn, seconds)

    def renew(self, optics: Optics, size_px: ScreenSize, part: Rect = WHOLE) -> None:
        """Begin the picture that is shown again, as its views have changed: `refine` draws it.

        What is shown stays until the new one is made of as many passes; it has a texture of its own already. Views that
        come in between are seen in the passes that follow, so that they do not keep the new one from being shown.
        """
        self._accumulation = self._accumulation_of(optics, size_px, BEST_QUALITY, part)
        self._shown_from_pass = min(self.passes_shown, self._accumulation.passes)

    def refine(self, budget_s: float = math.inf) -> None:
        """Draw more samples of the same picture, for about that long; the image changes after each pass."""
        if self.is_converged:
            return
        accumulation = self._current()
        start = time.perf_counter()
        pass_before, done_before, programs_before = accumulation.pass_index, accumulation.done, len(self.programs)
        self._draw(budget_s, passes=accumulation.passes)
        if accumulation.pass_index > pass_before and not self.is_renewing:
            self._finish()
        self.ctx.finish()
        seconds = time.perf_counter() - start
        if len(self.programs) == programs_before:
            self._refining_s = seconds / max(accumulation.done - done_before, 1) / math.prod(accumulation.size_px)
        if self.is_renewing:
            return
        self._learn(accumulation.done, seconds)

    def start_picture(self, settings: RenderSettings, field: LightFieldTexture | None = None) -> PictureDrawing:
        """A picture with every sample it will get, to be drawn step by step, and stopped once it is no longer wanted.

        What was drawn last stays as it is. field: it is drawn from, by default what the screen shows.
        """
        if settings.tile is not None:
            return self._start_tile(settings, settings.tile)
        field = self.drawn_field if field is None else field
        accumulator = Accumulator(self.ctx, self.programs)
        whole = self._accumulation_of(settings.optics, settings.size_px, BEST_QUALITY, settings.part, field)
        return PictureDrawing(self.gl, accumulator, field, whole, settings.is_linear, settings.color_space)

    def _start_tile(self, settings: RenderSettings, tile: LensTile) -> PictureDrawing:
        """A picture of the tile's own views, which nothing else shows."""
        first, *others = tile.views
        height, width = first.colors.shape[:2]
        field = LightFieldTexture(self.ctx, tile.grid, width, height, hdr=True, with_disparity=True)
        field.color_space = settings.color_space
        field.upload(first.row, first.column, first.colors, first.disparity)
        whole_width_px = settings.size_px.width / settings.part.width
        lens = replace(
            lens_of(settings.optics, field, round(whole_width_px * tile.window.width), widest=math.inf),
            highlight_gain=tile.highlight_gain,
            part=settings.part,
            field_part=tile.window,
        )
        whole = ProgressiveAccumulation(lens, settings.size_px, lens.pass_count(field))
        accumulator = Accumulator(self.ctx, self.programs)
        drawing = PictureDrawing(self.gl, accumulator, field, whole, settings.is_linear, settings.color_space, others)
        field.release()
        return drawing

    def converged_picture(self, settings: RenderSettings) -> NDArray[Any]:
        """The picture of `start_picture`, at once."""
        drawing = self.start_picture(settings)
        drawing.advance()
        drawing.stop()
        return drawing.image

    @property
    def is_converged(self) -> bool:
        """Whether more samples would not make the picture better."""
        return self._accumulation is None or self._accumulation.is_complete

    @property
    def is_renewing(self) -> bool:
        """Whether what is shown still waits for what `renew` has begun."""
        return self._accumulation is not None and self._accumulation.pass_index < self._shown_from_pass

    @property
    def samples_drawn(self) -> int:
        """How many points of the lens the picture drawn last is made of."""
        return self._current().done

    @property
    def samples_converged(self) -> int:
        """How many the converged picture is made of, about."""
        accumulation, field = self._current(), self.drawn_field
        in_all = accumulation.lens.sample_count(field) * accumulation.passes
        return accumulation.done if self.is_converged else max(in_all, accumulation.done)

    @property
    def image_texture(self) -> int:
        """GL name of the renderer's own image (RGBA8, rows bottom-up). Another picture may change it."""
        return self._screen.shown.image.textures[0].glo

    def read_image(self) -> NDArray[np.uint8]:
        """The picture as (H, W, 3) uint8, sRGB-encoded, row 0 at the top; stretched where it was drawn smaller."""
        image, drawn_px = self._screen.read(), self._screen.shown.size_px
        size_px = self._accumulation.size_px if self._accumulation else drawn_px
        return image if drawn_px == size_px else stretch_image(image, size_px)

    def read_pixel(self, u: float, v: float) -> tuple[int, int, int]:
        """The picture at texture coordinates (0..1, row 0 at the top), sRGB bytes."""
        return self._screen.read_pixel(u, v)

    def release(self) -> None:
        """Free every GL object."""
        self.programs.release()
        self._accumulator.release()
        self._screen.release()
        for field in (self.field, self._fallback_view):
            if field is not None:
                field.release()

    def _current(self) -> ProgressiveAccumulation:
        assert self._accumulation is not None, "render first"
        return self._accumulation

    def _accumulation_of(
        self,
        optics: Optics,
        size_px: ScreenSize,
        level: QualityLevel,
        part: Rect = WHOLE,
        field: LightFieldTexture | None = None,
    ) -> ProgressiveAccumulation:
        field = self.drawn_field if field is None else field
        whole_width_px = round(size_px[0] / part.width)
        lens = replace(lens_of(optics, field, whole_width_px, level), part=part)
        return ProgressiveAccumulation(lens, size_px, lens.pass_count(field))

    def _draw(self, budget_s: float, passes: int) -> None:
        accumulation = self._current()
        sample_s = self._refining_s * math.prod(accumulation.size_px)
        targets = self._screen.targets_of(accumulation.size_px)
        self._accumulator.sum_up(self.drawn_field, accumulation, targets, passes, budget_s, sample_s)

    def _finish(self) -> None:
        targets = self._screen.targets_of(self._current().size_px)
        self._accumulator.finish(self._current(), targets, targets.image.framebuffer, is_linear=False)
        self._screen.show(targets)
        self.passes_shown = self._current().pass_index

    def _work(self, optics: Optics, size_px: ScreenSize, part: Rect, level: QualityLevel) -> DrawCost:
        field = self.drawn_field
        lens = lens_of(optics, field, round(size_px[0] / part.width * level.scale), level)
        return DrawCost(
            samples=lens.sample_count(field),
            warps=bool(field.has_disparity.any()),
            pixels=math.prod(scale_size(size_px, level.scale)),
        )

    def _learn(self, samples: int, seconds: float) -> None:
        in_all = max(self.samples_converged, samples)
        self.report = DrawReport(samples, in_all, 1e3 * seconds)
