"""A picture is summed up in passes, each with its cameras elsewhere in the lens and in the pixel."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import moderngl

from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.programs import ProgramCache
from viewer.gpu.refocus.passes import MAX_SAMPLES, Passes, Rows
from viewer.gpu.refocus.picture_lens import Lens
from viewer.gpu.refocus.view_sampling import Samples
from viewer.gpu.render_targets import RenderTargets

LEAST_ROWS = 16
"""Rows of a step, at least: fewer save nothing, for a draw has its own cost."""


@dataclass
class ProgressiveAccumulation:
    """A picture on its way to its best: all cameras drawn up to camera `at` of pass `pass_index`, of `passes`.

    samples: of this pass. done: cameras drawn in all passes.
    """

    lens: Lens
    size_px: ScreenSize
    passes: int
    samples: Samples | None = None
    pass_index: int = 0
    at: int = 0
    done: int = 0

    @property
    def is_complete(self) -> bool:
        """Whether every pass is drawn."""
        return self.pass_index == self.passes


class Accumulator:
    """Sums light of a field into targets."""

    def __init__(self, ctx: moderngl.Context, programs: ProgramCache) -> None:
        self._ctx = ctx
        self.passes = Passes(ctx, programs)

    def release(self) -> None:
        """Free every GL object of its own."""
        self.passes.release()

    def sum_up(
        self,
        field: LightFieldTexture,
        accumulation: ProgressiveAccumulation,
        targets: RenderTargets,
        passes: int,
        budget_s: float = math.inf,
        seconds_per_sample: float = 0.0,
    ) -> None:
        """Draw cameras until so many passes are complete or the time is spent, with at least one camera.

        seconds_per_sample: how long one is thought to take; no more are drawn at once than there is time for.
        """
        if not field.present.any():
            targets.light.framebuffer.clear()
            accumulation.pass_index = accumulation.passes
            return
        end = time.perf_counter() + budget_s
        at_once = int(min(max(budget_s / max(seconds_per_sample, 1e-9), 1), MAX_SAMPLES))
        while accumulation.pass_index < passes:
            for _ in self._batch_steps(field, accumulation, targets, at_once, math.inf):
                pass
            if budget_s < math.inf:
                self._ctx.finish()  # a driver that queues its work tells no time before that
            if time.perf_counter() >= end:
                break
        self._ctx.disable(moderngl.BLEND)

    def sum_up_in_steps(
        self,
        field: LightFieldTexture,
        accumulation: ProgressiveAccumulation,
        targets: RenderTargets,
        pixels_per_step: float,
    ) -> Iterator[None]:
        """All passes, in steps of about so many pixels and cameras; between two, anything else may be drawn.

        The sum is the same to the last bit however small the steps are: they part rows, never cameras.
        """
        if not field.present.any():
            self.sum_up(field, accumulation, targets, accumulation.passes)
        while not accumulation.is_complete:
            yield from self._batch_steps(field, accumulation, targets, MAX_SAMPLES, pixels_per_step)

    def finish(
        self,
        accumulation: ProgressiveAccumulation,
        targets: RenderTargets,
        framebuffer: moderngl.Framebuffer,
        is_linear: bool,
        color_space: ColorSpace = SRGB,
    ) -> None:
        """Write what is summed up. is_linear: as light, unbounded, instead of encoded. color_space: of the result."""
        self._disable_tests()
        framebuffer.use()
        self.passes.present(accumulation.lens, targets, is_linear, color_space)

    def _batch_steps(
        self,
        field: LightFieldTexture,
        accumulation: ProgressiveAccumulation,
        targets: RenderTargets,
        count: int,
        pixels_per_step: float,
    ) -> Iterator[None]:
        """Draw the next cameras of a pass, at most count."""
        lens, at = accumulation.lens, accumulation.at
        if at == 0:
            accumulation.samples = lens.samples(field, accumulation.pass_index)
            if accumulation.pass_index == 0:
                targets.light.framebuffer.clear()
                if lens.has_dolly:
                    self.passes.update_nearest_views(field)
        samples = accumulation.samples
        assert samples is not None
        if lens.diameter == 0:
            count = len(samples)  # the views that answer a pinhole are blended: none is shown alone
        batch = samples.part(at, at + count)
        cell = lens.cell(accumulation.pass_index)
        for rows in _row_bands(targets.size_px, pixels_per_step / len(batch)):
            self._disable_tests()  # anything else may have been drawn meanwhile
            self.passes.draw_lens(field, lens, batch, accumulation.done, cell, targets, rows)
            yield
        accumulation.at, accumulation.done = at + len(batch), accumulation.done + len(batch)
        if accumulation.at >= len(samples):
            accumulation.pass_index, accumulation.at = accumulation.pass_index + 1, 0

    def _disable_tests(self) -> None:
        self._ctx.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)


def _row_bands(size_px: ScreenSize, pixels: float) -> list[Rows]:
    """The rows of a target in bands of so many pixels, at least LEAST_ROWS each."""
    width, height = size_px
    if width * height <= pixels:
        return [(0, height)]
    rows = max(int(pixels / width), LEAST_ROWS)
    return [(top, min(top + rows, height)) for top in range(0, height, rows)]
