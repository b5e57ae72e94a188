"""Draws a light field through a virtual lens: at once as well as the time allows, then better until nothing changes.

Everything a picture depends on is a uniform, so a change of focus, aperture or eye costs one drawing and nothing else.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import replace
from functools import partial
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import Optics
from iibr_core.beyond.picture_quality import BEST_QUALITY, QUALITY_LEVELS, QualityLevel
from iibr_core.exports.render_settings import LensTile, RenderSettings
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape
from viewer.gpu.context import GLContext
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.programs import ProgramCache
from viewer.gpu.refocus.frame_budget import (
    OPEN_FETCHES,
    FrameTimeModel,
    choose_quality_level,
    fetches_of,
    scale_size,
    stretch_image,
)
from viewer.gpu.refocus.passes import Passes, ProgressiveAccumulation
from viewer.gpu.refocus.picture_drawing import PictureDrawing
from viewer.gpu.refocus.picture_lens import lens_of
from viewer.gpu.render_targets import PictureTargets, TargetCache


class Renderer:
    """Draws one light field at a time. Call it only from the thread its context belongs to.

    field: None before the first. passes_shown: number of passes of the best picture on the screen, 0 for a softer
    picture. samples, samples_converged, draw_s: cameras of the last picture so far and in all, and the time of the
    last drawing in seconds. level: index of the last picture's quality level.
    """

    def __init__(self, gl: GLContext, programs: ProgramCache | None = None) -> None:
        """programs: of another renderer; pictures are then written by `present`. None for its own."""
        self.gl, self.ctx = gl, gl.ctx
        self.field: LightFieldTexture | None = None
        self.passes_shown = self.samples = self.samples_converged = 0
        self.draw_s = 0.0
        self._owns_programs, self.programs = programs is None, programs or ProgramCache(self.ctx)
        self._passes = Passes(self.ctx, self.programs)
        self._pinhole: PictureTargets | None = None
        self._opening: Iterator[None] | None = None
        self._targets = TargetCache(self.ctx)
        self._accumulation: ProgressiveAccumulation | None = None
        self._shown_from_pass = self._passes_opened = self.level = 0
        self._frame_time = FrameTimeModel(gl.seconds_per_fetch)
        self._refining_s = 4 * gl.seconds_per_fetch

    def show(self, field: LightFieldTexture) -> None:
        """Draw this field from now on. To be called again when anything but its views has changed."""
        self.field, self._accumulation = field, None

    @property
    def drawn_field(self) -> LightFieldTexture:
        """The field that is drawn. Raises ValueError before the first."""
        if self.field is None:
            raise ValueError("no light field is open")
        return self.field

    def render(
        self, optics: Optics, size_px: ScreenSize, level: QualityLevel = BEST_QUALITY, part: Rect = WHOLE
    ) -> None:
        """Draw the first pass of a picture at once (`image_texture`, `read_image`).

        level: its scale is ignored. part: part of the picture, stretched to size_px = (width, height). Before the first
        view the picture is black. Its framebuffer stays bound.
        """
        self._begin(self._accumulation_of(optics, size_px, level, part))
        self._draw(math.inf, passes=1)
        self._open_lens(math.inf)
        self._finish()

    def render_in_time(
        self, optics: Optics, size_px: ScreenSize, budget_s: float, part: Rect = WHOLE, level: int | None = None
    ) -> None:
        """Draw a picture as well as the time is expected to allow; `refine` then makes it better.

        The image may be smaller than size_px. part: part of the picture, stretched to size_px. level: index of the
        quality level, None to choose it.
        """
        start, programs = time.perf_counter(), len(self.programs)
        fetches = partial(self._fetches, optics, size_px, part)
        if level is None:
            level = choose_quality_level(fetches, self._frame_time, budget_s, self.level)
        self.level, quality = level, QUALITY_LEVELS[level]
        self.render(optics, scale_size(size_px, quality.scale), quality, part)
        self.ctx.finish()
        seconds = time.perf_counter() - start
        if len(self.programs) == programs:  # compiling says nothing about drawing
            self._frame_time.learn(fetches(quality), seconds)
        drawn = self._current
        self._refining_s = seconds / max(drawn.done, 1) / math.prod(drawn.size_px)
        if quality != BEST_QUALITY:
            self._begin(self._accumulation_of(optics, size_px, BEST_QUALITY, part))
            self.passes_shown = 0
        self._report(drawn.done, seconds)

    def renew(self, optics: Optics, size_px: ScreenSize, part: Rect = WHOLE, is_coarse: bool = False) -> None:
        """Begin the shown picture again because its views have changed: `refine` draws it.

        The old picture stays until the new one has as many passes; if it is coarse, until the new one has its first.
        Views that come in between are drawn in the passes that follow, so that they do not delay the new picture.
        """
        self.passes_shown = 0 if is_coarse else self.passes_shown
        self._begin(self._accumulation_of(optics, size_px, BEST_QUALITY, part))
        self._shown_from_pass = min(self.passes_shown, self._current.passes)

    def refine(self, budget_s: float = math.inf) -> None:
        """Draw more samples of the same picture, for about that long; the image changes after each pass."""
        if self.is_converged:
            return
        accumulation, programs, start = self._current, len(self.programs), time.perf_counter()
        passes_before, done_before = self._passes_ready, accumulation.done
        if not accumulation.is_complete:
            self._draw(budget_s, accumulation.passes)
            self.ctx.finish()
            if len(self.programs) == programs:
                sampled_s = (time.perf_counter() - start) / max(accumulation.done - done_before, 1)
                self._refining_s = sampled_s / math.prod(accumulation.size_px)
        if accumulation.is_complete:
            self._open_lens(start + budget_s - time.perf_counter())
        if self._passes_ready > passes_before and not self.is_renewing:
            self._finish()
        self.ctx.finish()
        seconds = time.perf_counter() - start
        if not self.is_renewing:
            self._report(accumulation.done, seconds)

    def start_picture(self, settings: RenderSettings, field: LightFieldTexture | None = None) -> PictureDrawing:
        """Return a picture with all its samples, to be drawn step by step, or stopped.

        The picture on the screen stays. field: drawn field, None for the field that the screen shows.
        """
        if settings.tile is not None:
            return self._start_tile(settings, settings.tile)
        field = self.drawn_field if field is None else field
        whole = self._accumulation_of(settings.optics, settings.size_px, BEST_QUALITY, settings.part, field)
        return PictureDrawing(self.gl, self.programs, whole, settings.is_linear, settings.color_space)

    def _start_tile(self, settings: RenderSettings, tile: LensTile) -> PictureDrawing:
        """Return a picture of the tile's own view."""
        height, width = tile.view.colors.shape[:2]
        field = LightFieldTexture(self.ctx, GridShape(1, 1), width, height, hdr=True, with_disparity=True)
        field.color_space = settings.color_space
        field.upload(0, 0, tile.view.colors, tile.view.disparity)
        whole_width_px = settings.size_px.width / settings.part.width
        field.set_hidden(tile.hidden)
        lens = replace(
            lens_of(settings.optics, field, round(whole_width_px * tile.window.width)),
            highlight_gain=tile.highlight_gain,
            part=settings.part,
            field_part=tile.window,
            hidden_scale=tile.hidden_scale,
            behind_eye=tile.behind_eye,
        )
        whole = ProgressiveAccumulation(field, lens, settings.size_px, lens.pass_count(field))
        drawing = PictureDrawing(self.gl, self.programs, whole, settings.is_linear, settings.color_space)
        field.release()
        return drawing

    def converged_picture(self, settings: RenderSettings) -> NDArray[Any]:
        """Return the picture of `start_picture`, drawn at once."""
        drawing = self.start_picture(settings)
        drawing.advance()
        drawing.stop()
        return drawing.image

    @property
    def is_converged(self) -> bool:
        """Whether more samples would not make the picture better."""
        return self._accumulation is None or self._passes_ready == self._accumulation.passes

    @property
    def is_renewing(self) -> bool:
        """Whether the picture that `renew` has begun is not shown yet."""
        return self._accumulation is not None and self._passes_ready < self._shown_from_pass

    @property
    def image_texture(self) -> int:
        """GL name of the shown image (RGBA8, rows bottom-up). Another picture may change it."""
        return self._shown.image.texture.glo

    def present(self, framebuffer: moderngl.Framebuffer) -> None:
        """Write the shown image into the viewport of a framebuffer, which has the size `shown_px`."""
        self._passes.present(self._current.lens, self._shown, into=framebuffer)

    @property
    def shown_px(self) -> ScreenSize:
        """Size of the shown image."""
        return self._shown.size_px

    def read_image(self) -> NDArray[np.uint8]:
        """Return the picture (H, W, 3), sRGB-encoded, row 0 at the top; stretched if it was drawn smaller."""
        image, size_px = self._shown.image.read(), self._shown.size_px
        wanted_px = self._accumulation.size_px if self._accumulation else size_px
        return image if size_px == wanted_px else stretch_image(image, wanted_px)

    def read_pixel(self, u: float, v: float) -> tuple[int, int, int]:
        """Return the picture's colour at texture coordinates (0..1, row 0 at the top), sRGB bytes."""
        x, y = (min(max(int(at * size), 0), size - 1) for at, size in zip((u, 1 - v), self._shown.size_px))
        red, green, blue = self._shown.image.framebuffer.read((x, y, 1, 1), components=3, alignment=1)
        return red, green, blue

    def release(self) -> None:
        """Free every GL object but the field."""
        if self._owns_programs:
            self.programs.release()
        self._passes.release()
        if self._pinhole is not None:
            self._pinhole.release()
        self._targets.release()

    @property
    def _current(self) -> ProgressiveAccumulation:
        assert self._accumulation is not None, "render first"
        return self._accumulation

    @property
    def _shown(self) -> PictureTargets:
        assert self._targets.shown is not None, "render first"
        return self._targets.shown

    def _accumulation_of(
        self,
        optics: Optics,
        size_px: ScreenSize,
        level: QualityLevel,
        part: Rect = WHOLE,
        field: LightFieldTexture | None = None,
    ) -> ProgressiveAccumulation:
        field = field or self.drawn_field
        lens = replace(lens_of(optics, field, round(size_px[0] / part.width), level), part=part)
        return ProgressiveAccumulation(field, lens, ScreenSize(*size_px), lens.pass_count(field))

    def _begin(self, accumulation: ProgressiveAccumulation) -> None:
        self._accumulation, self._opening = accumulation, None
        self._shown_from_pass = self._passes_opened = 0

    @property
    def _passes_ready(self) -> int:
        """Number of passes that the picture being drawn can show."""
        accumulation = self._current
        return self._passes_opened if accumulation.lens.slices else accumulation.pass_index

    def _draw(self, budget_s: float, passes: int) -> None:
        accumulation = self._current
        sample_s = self._refining_s * math.prod(accumulation.size_px)
        if accumulation.lens.slices:
            target = self._pinhole_targets(accumulation.drawn_px).light.framebuffer
        else:
            target = self._targets.get(accumulation.size_px).light.framebuffer
        self._passes.sum_up(accumulation, target, passes, budget_s, sample_s)

    def _pinhole_targets(self, size_px: ScreenSize) -> PictureTargets:
        if self._pinhole is None or self._pinhole.size_px != size_px:
            if self._pinhole is not None:
                self._pinhole.release()
            self._pinhole = PictureTargets(self.ctx, size_px, "f4")
        return self._pinhole

    def _open_lens(self, budget_s: float) -> None:
        """Blur the pinhole's picture as an open lens does, for about that long."""
        accumulation, end = self._current, time.perf_counter() + budget_s
        if not accumulation.lens.slices:
            return
        if self._opening is None:
            pinhole, target = self._pinhole_targets(accumulation.drawn_px), self._targets.get(accumulation.size_px)
            self._opening = self._passes.open_lens(accumulation, pinhole, target.light.framebuffer)
        for _ in self._opening:
            if budget_s < math.inf:
                self.ctx.finish()
            if time.perf_counter() >= end:
                return
        self._opening, self._passes_opened = None, accumulation.pass_index

    def _finish(self) -> None:
        self._targets.shown = targets = self._targets.get(self._current.size_px)
        if self._owns_programs:
            self._passes.present(self._current.lens, targets)
        self.passes_shown = self._passes_ready

    def _fetches(self, optics: Optics, size_px: ScreenSize, part: Rect, level: QualityLevel) -> float:
        field = self.drawn_field
        lens = lens_of(optics, field, round(size_px[0] / part.width * level.scale), level)
        pixels = math.prod(scale_size(size_px, level.scale))
        fetches = fetches_of(lens.sample_count(field), pixels, bool(field.has_disparity.any()))
        return fetches + (OPEN_FETCHES * pixels if lens.slices else 0.0)

    def _report(self, samples: int, seconds: float) -> None:
        """Keep the numbers of the last picture."""
        self.samples, self.draw_s, accumulation = samples, seconds, self._current
        in_all = accumulation.lens.sample_count(self.drawn_field) * accumulation.passes
        self.samples_converged = samples if self.is_converged else max(in_all, accumulation.done, samples + 1)
