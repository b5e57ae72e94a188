"""Draws a light field through a virtual lens: at once as well as the time allows, then better until nothing changes.

Everything a picture depends on is a uniform, so a change of focus, aperture or eye costs one drawing and nothing else.
"""

from __future__ import annotations

import math
import time

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage, GridShape, InputError, StoredColors, ViewOffset
from viewer.gpu.context import GLContext
from viewer.gpu.error_estimate import ErrorEstimate
from viewer.gpu.lens import Lens, lens_of
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.passes import MAX_SAMPLES, TILE_PX, Passes
from viewer.gpu.programs import ProgramCache
from viewer.gpu.summation import Summation, even_places, rounds_of
from viewer.gpu.targets import Targets
from viewer.gpu.view_choice import ApertureSample, clamped_to_grid, nearest_present
from viewer.state import DrawReport, Optics

STRIDES = (1, 2, 3, 4)
"""View steps between the samples of a picture drawn in a hurry: the least for which there is time."""

LEAST_ACROSS = 2.0
"""Samples across the aperture, at least."""


class Renderer:
    """Draws one light field at a time. Call it only from the thread its context belongs to.

    prefilter: smooth what lies between sparse samples; off, it shows them as separate copies. adaptive: tiles skip the
    layers they have no content for. report: what is known of the picture drawn last. note: what had to be left out, a
    sentence for people.
    """

    def __init__(self, gl: GLContext, prefilter: bool = True, adaptive: bool = True) -> None:
        self.gl = gl
        self.ctx = gl.ctx
        self.prefilter = prefilter
        self.field: LightFieldTexture | None = None
        self.report = DrawReport()
        self.note = ""
        self.programs = ProgramCache(self.ctx)
        self._passes = Passes(self.ctx, self.programs)
        self._passes.adaptive = adaptive
        self._targets: Targets | None = None
        self._summation: Summation | None = None
        self._cost_s = gl.seconds_per_sample
        self._refining_cost_s = 4 * gl.seconds_per_sample
        self._errors = ErrorEstimate()

    @property
    def adaptive(self) -> bool:
        """Whether tiles skip the layers they have no content for."""
        return self._passes.adaptive

    @adaptive.setter
    def adaptive(self, is_on: bool) -> None:
        self._passes.adaptive = is_on

    def open_field(self, grid: GridShape, width: int, height: int, hdr: bool, with_disparity: bool) -> None:
        """Start an empty light field of this size in place of the one before.

        Where the graphics driver cannot hold all views, fewer are kept, and `note` says so. Raises InputError where it
        cannot hold a single one; the old field then stays.
        """
        field, self.note = _field_that_fits(self.ctx, grid, width, height, hdr, with_disparity)
        if self.field is not None:
            self.field.release()
        self.field = field
        self._summation = None

    def upload_view(self, row: int, column: int, colors: StoredColors, disparity: FloatImage | None) -> None:
        """Add or replace one view; see LightFieldTexture.upload."""
        self._open_field().upload(row, column, colors, disparity)
        self._summation = None

    def render(
        self,
        optics: Optics,
        size_px: tuple[int, int],
        framebuffer: moderngl.Framebuffer | None = None,
        stride: int = 1,
    ) -> None:
        """Draw the picture at once, stretched to size_px = (width, height), with every view the aperture sees.

        framebuffer: drawn into its current viewport, which should have that size; None draws into the renderer's own
        image (`image_texture`, `read_image`). stride: view steps between the samples. Before the first view the picture
        is black. The framebuffer stays bound.
        """
        self._begin(optics, size_px, stride)
        self._sum_up(math.inf, rounds=1)
        self._finish(framebuffer)
        self._errors.begin(stride)

    def render_in_time(self, optics: Optics, size_px: tuple[int, int], budget_s: float) -> None:
        """Draw the picture with as many samples as the time is thought to allow; `refine` then makes it better."""
        start = time.perf_counter()
        programs_before = len(self.programs)
        stride = self._stride_for(optics, size_px, budget_s)
        self.render(optics, size_px, stride=stride)
        self.ctx.finish()
        seconds = time.perf_counter() - start
        summation = self._current()
        if summation.lens.aperture_share > 0 and len(self.programs) == programs_before:
            of_samples = max(seconds / math.prod(size_px) - self.gl.seconds_per_picture, 0.0)
            self._cost_s = max(of_samples / summation.done, self.gl.seconds_per_sample / 4)
        if stride > 1:
            self._begin(optics, size_px, 1)
        self._tell(summation.done, seconds)

    def refine(self, budget_s: float = math.inf) -> None:
        """Draw more samples of the same picture, for about that long; the image changes after each round."""
        if self.is_converged:
            return
        summation = self._current()
        if self._errors.is_new:
            self._errors.add(self.read_image(), 0)
        start = time.perf_counter()
        round_before, done_before, programs_before = summation.round, summation.done, len(self.programs)
        self._sum_up(budget_s, rounds=len(summation.places))
        if summation.round > round_before:
            self._finish(None)
        self.ctx.finish()
        seconds = time.perf_counter() - start
        if len(self.programs) == programs_before:
            self._refining_cost_s = seconds / max(summation.done - done_before, 1) / math.prod(summation.size_px)
        if summation.round > round_before and (summation.is_complete or math.log2(summation.round).is_integer()):
            self._errors.add(self.read_image(), summation.round)
        self._tell(summation.done, seconds)

    @property
    def is_converged(self) -> bool:
        """Whether more samples would not make the picture better."""
        return self._summation is None or self._summation.is_complete

    @property
    def samples_drawn(self) -> int:
        """How many points of the lens the picture drawn last is made of."""
        return self._current().done

    @property
    def samples_converged(self) -> int:
        """How many the converged picture is made of, about."""
        summation, field = self._current(), self._open_field()
        per_round = 1
        if summation.lens.aperture_share > 0 and field.present.any():
            per_round = len(summation.lens.samples(field.grid, field.present))
        return summation.done if self.is_converged else max(per_round * len(summation.places), summation.done)

    @property
    def image_texture(self) -> int:
        """GL name of the renderer's own image (RGBA8, rows bottom-up). A new size may change it."""
        assert self._targets is not None, "render first"
        return self._targets.image.textures[0].glo

    def read_image(self) -> NDArray[np.uint8]:
        """The renderer's own image as (H, W, 3) uint8, sRGB-encoded, row 0 at the top."""
        assert self._targets is not None, "render first"
        width, height = self._targets.size_px
        pixels = np.frombuffer(self._targets.image.framebuffer.read(components=3, alignment=1), np.uint8)
        return pixels.reshape(height, width, 3)[::-1].copy()

    def release(self) -> None:
        """Free every GL object."""
        self.programs.release()
        self._passes.release()
        if self._targets is not None:
            self._targets.release()
            self._targets = None
        if self.field is not None:
            self.field.release()
            self.field = None

    def _current(self) -> Summation:
        assert self._summation is not None, "render first"
        return self._summation

    def _open_field(self) -> LightFieldTexture:
        if self.field is None:
            raise ValueError("no light field is open")
        return self.field

    def _targets_of(self, size_px: tuple[int, int]) -> Targets:
        if self._targets is None or self._targets.size_px != size_px:
            if self._targets is not None:
                self._targets.release()
            self._targets = Targets(self.ctx, size_px, TILE_PX)
        return self._targets

    def _begin(self, optics: Optics, size_px: tuple[int, int], stride: int) -> None:
        field = self._open_field()
        lens = lens_of(optics, field, size_px[0], self.prefilter, stride)
        count = rounds_of(lens, field) if stride == 1 and field.present.any() else 1
        self._summation = Summation(lens, size_px, tuple(even_places(count)))

    def _sum_up(self, budget_s: float, rounds: int) -> None:
        """Draw samples until the time is spent or so many rounds are complete."""
        summation = self._current()
        self.ctx.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
        targets = self._targets_of(summation.size_px)
        if not self._open_field().present.any():
            for target in (targets.light, targets.blurred):
                target.framebuffer.clear()
            summation.round = len(summation.places)
            return
        end = time.perf_counter() + budget_s
        while summation.round < rounds:
            sample_s = self._refining_cost_s * math.prod(summation.size_px)
            self._draw_some(summation, targets, _batch_size(budget_s, sample_s))
            if time.perf_counter() >= end:
                break
        self.ctx.disable(moderngl.BLEND)

    def _draw_some(self, summation: Summation, targets: Targets, count: int) -> None:
        """Draw the next samples; the pinhole's share comes with the first of a round."""
        field, lens = self._open_field(), summation.lens
        if summation.at == 0:
            self._start_round(summation, targets)
        batch = _alike(summation.samples[summation.at :][:count], field)
        layers = {"SHARP": targets.light, "BLURRED": targets.blurred} if lens.keeps_layers else {"": targets.light}
        for layer, target in layers.items():
            if summation.at == 0 and lens.aperture_share < 1:
                self._passes.draw_pinhole(field, lens, summation.within_px, target, layer)
            if batch:
                self._passes.draw_aperture(field, lens, batch, summation.few, target, targets, layer)
        summation.at += len(batch)
        summation.done += max(len(batch), 1)
        if summation.at >= len(summation.samples):
            summation.round, summation.at = summation.round + 1, 0

    def _start_round(self, summation: Summation, targets: Targets) -> None:
        field, lens, place = self._open_field(), summation.lens, summation.places[summation.round]
        moved = ViewOffset(lens.stride * place.t, lens.stride * place.s)
        summation.samples, summation.few = [], {}
        if lens.aperture_share > 0:
            summation.few = self._few_samples(lens, moved)
            summation.samples = sorted(
                lens.samples(field.grid, field.present, moved),
                key=lambda sample: (sample.wanted not in summation.few, not _is_direct(sample, field)),
            )
        if summation.round > 0:
            return
        targets.light.start_sum()
        targets.blurred.start_sum()
        if lens.has_dolly:
            self._passes.update_stand_ins(field)
        if lens.keeps_layers:
            self._passes.find_defocus(field, lens, summation.samples or [_eye_sample(lens, field)], targets)

    def _few_samples(self, lens: Lens, moved: ViewOffset) -> dict[ViewOffset, float]:
        """Weights of every other sample across and down."""
        field = self._open_field()
        every = {sample.wanted for sample in lens.samples(field.grid, field.present, moved)}
        coarse = lens.samples(field.grid, field.present, moved, coarser=2)
        few = {sample.wanted: sample.weight for sample in coarse if sample.wanted in every}
        return {wanted: weight / sum(few.values()) for wanted, weight in few.items()}

    def _finish(self, framebuffer: moderngl.Framebuffer | None) -> None:
        """Smooth what is summed up and show it."""
        summation, targets = self._current(), self._targets
        assert targets is not None
        self.ctx.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
        if summation.lens.keeps_layers:
            self._passes.smooth(summation.lens, targets, 1 / math.sqrt(max(summation.round, 1)))
        (framebuffer or targets.image).use()
        self._passes.present(summation.lens, targets)

    def _stride_for(self, optics: Optics, size_px: tuple[int, int], budget_s: float) -> int:
        """The least that is thought to be drawn in time."""
        field = self._open_field()
        if lens_of(optics, field, size_px[0], self.prefilter).aperture_share == 0 or not field.present.any():
            return 1
        per_sample = self._cost_s * math.prod(size_px)
        for stride in STRIDES:
            if stride > max(optics.aperture_diameter / LEAST_ACROSS, 1.0):
                return stride - 1
            lens = lens_of(optics, field, size_px[0], self.prefilter, stride)
            if len(lens.samples(field.grid, field.present)) * per_sample <= budget_s:
                return stride
        return STRIDES[-1]

    def _tell(self, samples: int, seconds: float) -> None:
        in_all = max(self.samples_converged, samples)
        self.report = DrawReport(samples, in_all, 1e3 * seconds, self._errors.estimate)


def _field_that_fits(
    ctx: moderngl.Context, grid: GridShape, width: int, height: int, hdr: bool, with_disparity: bool
) -> tuple[LightFieldTexture, str]:
    """Room for as many views as the driver can hold, and a sentence where that is not all."""
    note = ""
    for stride in range(1, max(grid) + 1):
        try:
            return LightFieldTexture(ctx, grid, width, height, hdr, with_disparity, stride), note
        except InputError as error:
            if stride == max(grid):
                raise
            note = f"showing every {_ordinal(stride + 1)} view across and down: {error}"
    raise AssertionError("the last try returns or raises")


def _ordinal(number: int) -> str:
    return f"{number}{ {2: 'nd', 3: 'rd'}.get(number, 'th') }"


def _is_direct(sample: ApertureSample, field: LightFieldTexture) -> bool:
    return field.grid.offset(sample.row, sample.column) == sample.wanted


def _alike(samples: list[ApertureSample], field: LightFieldTexture) -> list[ApertureSample]:
    """The first of them that one program can draw."""
    for i, sample in enumerate(samples):
        if _is_direct(sample, field) != _is_direct(samples[0], field):
            return samples[:i]
    return samples


def _batch_size(budget_s: float, sample_s: float) -> int:
    return int(min(max(budget_s / sample_s, 1), MAX_SAMPLES))


def _eye_sample(lens: Lens, field: LightFieldTexture) -> ApertureSample:
    """The eye, answered by the present view nearest to it."""
    inside = clamped_to_grid(lens.eye, field.grid)
    row, column = round(inside.t) + field.grid.centre[0], round(inside.s) + field.grid.centre[1]
    stored = nearest_present(field.present)[row, column]
    return ApertureSample(lens.eye, int(stored[0]), int(stored[1]), 1.0)
