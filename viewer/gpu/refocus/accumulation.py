"""Pictures as sums of passes, each with its cameras at other places of the lens and of the pixel."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator

import moderngl

from iibr_core.beyond.picture_quality import MAX_SAMPLES
from iibr_core.scenes.screen_size import ScreenSize
from viewer.gpu.programs import ProgramCache
from viewer.gpu.refocus.discs import Discs
from viewer.gpu.refocus.passes import Passes, ProgressiveAccumulation, Rows
from viewer.gpu.render_targets import PictureTargets, clear

MIN_ROWS = 16
"""Smallest number of rows of a step: fewer rows save no time, because a draw has a cost of its own."""


class Accumulator:
    """Sums light of a field into targets, and blurs it. passes: draw the parts."""

    def __init__(self, ctx: moderngl.Context, programs: ProgramCache) -> None:
        self._ctx = ctx
        self.passes = Passes(ctx, programs)
        self._discs = Discs(ctx, programs)

    def release(self) -> None:
        """Free every GL object but the programs."""
        self.passes.release()
        self._discs.release()

    def sum_up(
        self,
        accumulation: ProgressiveAccumulation,
        target: moderngl.Framebuffer,
        passes: int,
        budget_s: float = math.inf,
        seconds_per_sample: float = 0.0,
    ) -> None:
        """Draw cameras until `passes` passes are complete or the time is spent, at least one camera.

        seconds_per_sample: expected time of a camera; one draw takes no more cameras than there is time for.
        """
        end = time.perf_counter() + budget_s
        count = int(min(max(budget_s / max(seconds_per_sample, 1e-9), 1), MAX_SAMPLES))
        while accumulation.pass_index < passes:
            for _ in self._draw_batch(accumulation, target, count, math.inf):
                pass
            if budget_s < math.inf:
                self._ctx.finish()  # a driver that queues its work shows no time before
            if time.perf_counter() >= end:
                break
        self._ctx.disable(moderngl.BLEND)

    def sum_up_in_steps(
        self,
        accumulation: ProgressiveAccumulation,
        target: moderngl.Framebuffer,
        pixels_per_step: float,
    ) -> Iterator[None]:
        """Draw all passes in steps of about so many pixels times cameras; anything else may be drawn between two steps.

        The sum does not depend on the size of the steps, to the last bit: they split rows, never cameras.
        """
        while not accumulation.is_complete:
            yield from self._draw_batch(accumulation, target, MAX_SAMPLES, pixels_per_step)

    def open_lens(
        self, accumulation: ProgressiveAccumulation, pinhole: PictureTargets, target: moderngl.Framebuffer
    ) -> Iterator[None]:
        """Blur a pinhole's picture, which was summed up, as an open lens does, a tile a step."""
        self._draw_disparity(accumulation, pinhole.image.framebuffer)
        field, lens = accumulation.field, accumulation.lens
        yield from self._discs.steps(field, lens, pinhole.light.texture, pinhole.image.texture, target)

    def _draw_disparity(self, accumulation: ProgressiveAccumulation, target: moderngl.Framebuffer) -> None:
        """Draw the disparity that the eye sees, after a pass."""
        clear(target)
        if accumulation.samples is not None:
            batch, rows = accumulation.samples.part(0, 1), (0, target.size[1])
            self.passes.draw_lens(accumulation, batch, target, rows, is_disparity=True)
        self._ctx.disable(moderngl.BLEND)

    def _draw_batch(
        self,
        accumulation: ProgressiveAccumulation,
        target: moderngl.Framebuffer,
        count: int,
        pixels_per_step: float,
    ) -> Iterator[None]:
        """Draw the next cameras of a pass, at most `count`, in bands of rows."""
        field, lens, at = accumulation.field, accumulation.drawn_lens, accumulation.at
        if at == 0 and accumulation.pass_index == 0:
            clear(target)
        if not field.present.any():
            accumulation.pass_index = accumulation.passes
            return
        if at == 0:
            accumulation.samples = lens.samples(field)
            if accumulation.pass_index == 0 and lens.has_dolly:
                self.passes.update_nearest_views(field)
        samples = accumulation.samples
        assert samples is not None
        # The views that answer a pinhole are blended: none is shown alone.
        batch = samples if lens.diameter == 0 else samples.part(at, at + count)
        for rows in _row_bands(ScreenSize(*target.size), pixels_per_step / len(batch)):
            self._ctx.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
            self.passes.draw_lens(accumulation, batch, target, rows)
            yield
        accumulation.at, accumulation.done = at + len(batch), accumulation.done + len(batch)
        if accumulation.at >= len(samples):
            accumulation.pass_index, accumulation.at = accumulation.pass_index + 1, 0


def _row_bands(size_px: ScreenSize, pixels: float) -> list[Rows]:
    """Return the rows of a target in bands of about so many pixels, at least MIN_ROWS each."""
    width, height = size_px
    if width * height <= pixels:
        return [(0, height)]
    rows = max(int(pixels / width), MIN_ROWS)
    return [(top, min(top + rows, height)) for top in range(0, height, rows)]
