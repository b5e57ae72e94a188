"""A still picture is summed up in passes, each with its samples elsewhere in the lens and in the pixel."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass
from dataclasses import field as dataclass_field

import moderngl

from iibr_core.scenes import ScreenSize, clamp_to_grid
from iibr_core.types import SRGB, ColorSpace, ViewOffset
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.programs import ProgramCache
from viewer.gpu.refocus.passes import MAX_SAMPLES, Passes
from viewer.gpu.refocus.picture_cells import WHOLE_CELL, PictureCell
from viewer.gpu.refocus.picture_lens import Lens, passes_for
from viewer.gpu.refocus.view_sampling import ApertureSample, nearest_present
from viewer.gpu.render_targets import RenderTarget, RenderTargets

MAX_PASSES = 16
"""A still picture is the mean of at most so many passes, each with its samples elsewhere."""

STILL_SAMPLES = 600
"""More passes than these samples need are not worth the wait."""

EDGE_PASSES = 5
"""Passes that make the edges of a warped view smooth."""


@dataclass
class ProgressiveAccumulation:
    """A picture on its way to its best: passes of samples, all drawn up to sample `at` of pass `pass_index`.

    places: in a square of side 1, how far the lattice of samples is moved in each pass. samples, sparse: of this pass,
    see `Passes.draw_aperture`. done: samples drawn in all passes.
    """

    lens: Lens
    size_px: ScreenSize
    places: tuple[ViewOffset, ...]
    samples: list[ApertureSample] = dataclass_field(default_factory=list)
    sparse: dict[ViewOffset, float] = dataclass_field(default_factory=dict)
    pass_index: int = 0
    at: int = 0
    done: int = 0

    @property
    def within_px(self) -> ViewOffset:
        """Where in a pixel this pass asks which surface shows."""
        return self.places[self.pass_index]

    @property
    def is_complete(self) -> bool:
        """Whether every pass is drawn."""
        return self.pass_index == len(self.places)


def pass_count(lens: Lens, field: LightFieldTexture) -> int:
    """How many passes, until neighbouring samples are close wherever the picture blurs most, and edges smooth."""
    count = 1
    if lens.aperture_share > 0 and lens.keeps_layers:
        affordable = STILL_SAMPLES // len(lens.samples(field.grid, field.present))
        count = min(passes_for(lens.widest_blur_px), MAX_PASSES, affordable)
    is_warped = field.has_disparity.any() and (lens.has_dolly or not is_stored(lens.eye, field))
    if lens.aperture_share < 1 and is_warped:
        count = max(count, EDGE_PASSES)
    return max(count, 1)


def is_stored(eye: ViewOffset, field: LightFieldTexture) -> bool:
    """Whether a view that is there lies at this viewpoint."""
    row, column = float(eye.t + field.grid.centre[0]), float(eye.s + field.grid.centre[1])
    is_on_grid = 0 <= row < field.grid.rows and 0 <= column < field.grid.columns
    return is_on_grid and row.is_integer() and column.is_integer() and bool(field.present[int(row), int(column)])


def r2_sequence(count: int) -> list[ViewOffset]:
    """Places in a square of side 1, one a pass, evenly spread, the first in the middle (the R2 sequence)."""
    return [
        ViewOffset(*((k * step + 0.5) % 1.0 - 0.5 for step in (0.7548776662466927, 0.5698402909980532)))
        for k in range(count)
    ]


PINHOLE_SAMPLES = 24
"""What the pinhole view costs a pixel, in samples of the aperture, about: it searches."""

LEAST_ROWS = 16
"""Of a step: fewer save nothing, for a draw has its own cost."""


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
        """Draw samples until so many passes are complete or the time is spent, with at least one sample.

        seconds_per_sample: how long one is thought to take; no more are drawn at once than there is time for.
        """
        if not field.present.any():
            targets.sum_of(accumulation.lens.keeps_layers).framebuffer.clear()
            accumulation.pass_index = len(accumulation.places)
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
        """All passes, in steps of about so many pixels and samples, and of one program; between two, anything else may
        be drawn.

        The sum is the same to the last bit however small the steps are: they part rows, never samples.
        """
        if not field.present.any():
            self.sum_up(field, accumulation, targets, len(accumulation.places))
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
        """Smooth what is summed up and write it. is_linear: as light, unbounded, instead of encoded. color_space: of
        the result.
        """
        self._disable_tests()
        lens, passes = accumulation.lens, max(accumulation.pass_index, 1)
        if lens.keeps_layers:
            self.passes.smooth(lens, targets, passes)
        framebuffer.use()
        self.passes.present(lens, targets, passes, is_linear, color_space)

    def _batch_steps(
        self,
        field: LightFieldTexture,
        accumulation: ProgressiveAccumulation,
        targets: RenderTargets,
        count: int,
        pixels_per_step: float,
    ) -> Iterator[None]:
        """Draw the next samples, at most count; the pinhole's share comes with the first of a pass."""
        self._disable_tests()
        for _ in self._draw_batch(field, accumulation, targets, count, pixels_per_step):
            yield
            self._disable_tests()  # anything else may have been drawn meanwhile

    def _draw_batch(
        self,
        field: LightFieldTexture,
        accumulation: ProgressiveAccumulation,
        targets: RenderTargets,
        count: int,
        pixels_per_step: float,
    ) -> Iterator[None]:
        lens = accumulation.lens
        if accumulation.at == 0:
            yield from self._start_pass(field, accumulation, targets)
        batch = _first_batch(accumulation.samples[accumulation.at :][:count], field)
        has_pinhole = accumulation.at == 0 and lens.aperture_share < 1
        target = targets.sum_of(lens.keeps_layers)
        for rows in _row_bands(target, pixels_per_step / PINHOLE_SAMPLES) if has_pinhole else ():
            yield from self.passes.draw_pinhole(field, lens, accumulation.within_px, targets, rows)
        for rows in _row_bands(target, pixels_per_step / len(batch)) if batch else ():
            self.passes.draw_aperture(field, lens, batch, accumulation.sparse, targets, rows, accumulation.pass_index)
            yield
        accumulation.at += len(batch)
        accumulation.done += max(len(batch), 1)
        if accumulation.at >= len(accumulation.samples):
            accumulation.pass_index, accumulation.at = accumulation.pass_index + 1, 0
            if lens.keeps_layers:
                self.passes.weigh_alike(lens, targets, accumulation.pass_index)
                yield

    def _disable_tests(self) -> None:
        self._ctx.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)

    def _start_pass(
        self, field: LightFieldTexture, accumulation: ProgressiveAccumulation, targets: RenderTargets
    ) -> Iterator[None]:
        lens, place = accumulation.lens, accumulation.places[accumulation.pass_index]
        moved = ViewOffset(lens.stride * place.t, lens.stride * place.s)
        accumulation.samples, accumulation.sparse = [], {}
        if lens.aperture_share > 0:
            # Smoothing narrows with the passes: in all it stays as much as that of the first, which leave room for it.
            leaves_room = accumulation.pass_index < lens.smoothing_spread**2
            every = lens.samples(field.grid, field.present, moved, is_smoothed=leaves_room)
            accumulation.sparse = _sparse_weights(every, lens, field, moved)
            accumulation.samples = sorted(
                every, key=lambda sample: (sample.wanted not in accumulation.sparse, not _is_direct(sample, field))
            )
        if accumulation.pass_index > 0:
            return
        targets.sum_of(lens.keeps_layers).framebuffer.clear()
        if lens.has_dolly:
            self.passes.update_fallback_views(field)
        if lens.keeps_layers:
            samples = accumulation.samples or [_eye_sample(lens, field)]
            yield from self.passes.find_defocus(field, lens, samples, targets)


def _row_bands(target: RenderTarget, pixels: float) -> list[PictureCell]:
    """The rows of a target in bands of so many pixels, at least LEAST_ROWS each, in texture coordinates of it."""
    width, height = target.framebuffer.size
    if width * height <= pixels:
        return [WHOLE_CELL]
    rows = max(int(pixels / width), LEAST_ROWS)
    return [PictureCell(0.0, top / height, 1.0, min(top + rows, height) / height) for top in range(0, height, rows)]


def _sparse_weights(
    every: list[ApertureSample], lens: Lens, field: LightFieldTexture, moved: ViewOffset
) -> dict[ViewOffset, float]:
    """Weights of every other sample across and down."""
    wanted = {sample.wanted for sample in every}
    coarse = lens.samples(field.grid, field.present, moved, coarser=2, is_smoothed=False)
    sparse = {sample.wanted: sample.weight for sample in coarse if sample.wanted in wanted}
    return {place: weight / sum(sparse.values()) for place, weight in sparse.items()}


def _is_direct(sample: ApertureSample, field: LightFieldTexture) -> bool:
    return field.grid.offset(sample.row, sample.column) == sample.wanted


def _first_batch(samples: list[ApertureSample], field: LightFieldTexture) -> list[ApertureSample]:
    """The first of them that one program can draw."""
    for i, sample in enumerate(samples):
        if _is_direct(sample, field) != _is_direct(samples[0], field):
            return samples[:i]
    return samples


def _eye_sample(lens: Lens, field: LightFieldTexture) -> ApertureSample:
    """The eye, answered by the present view nearest to it."""
    inside = clamp_to_grid(lens.eye, field.grid)
    row, column = round(inside.t) + field.grid.centre[0], round(inside.s) + field.grid.centre[1]
    stored = nearest_present(field.present)[row, column]
    return ApertureSample(lens.eye, int(stored[0]), int(stored[1]), 1.0)
