"""Draws the rounds of samples that a picture is summed up from, and puts them together. What to draw is a Summation."""

from __future__ import annotations

import math
import time

import moderngl

from iibr_core.types import ViewOffset
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.programs import ProgramCache
from viewer.gpu.refocus.lens import Lens
from viewer.gpu.refocus.passes import MAX_SAMPLES, Passes
from viewer.gpu.refocus.summation import Summation
from viewer.gpu.refocus.view_sampling import ApertureSample, clamped_to_grid, nearest_present
from viewer.gpu.render_targets import Targets

HIGHLIGHT_SPREAD = 2.0
"""Samples of many rounds lie unevenly: beside single bright pixels their gaps show, unless smoothing is wider."""


class Drawing:
    """Sums light of a field into targets. adaptive: whether tiles skip what they have no content for."""

    def __init__(self, ctx: moderngl.Context, programs: ProgramCache) -> None:
        self._ctx = ctx
        self.passes = Passes(ctx, programs)

    def release(self) -> None:
        """Free every GL object of its own."""
        self.passes.release()

    def sum_up(
        self,
        field: LightFieldTexture,
        summation: Summation,
        targets: Targets,
        rounds: int,
        budget_s: float = math.inf,
        seconds_per_sample: float = 0.0,
    ) -> None:
        """Draw samples until so many rounds are complete or the time is spent, with at least one sample.

        seconds_per_sample: how long one is thought to take; no more are drawn at once than there is time for.
        """
        self._ctx.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
        if not field.present.any():
            for target in (targets.light, targets.blurred):
                target.framebuffer.clear()
            summation.round = len(summation.places)
            return
        end = time.perf_counter() + budget_s
        at_once = int(min(max(budget_s / max(seconds_per_sample, 1e-9), 1), MAX_SAMPLES))
        while summation.round < rounds:
            self._draw_some(field, summation, targets, at_once)
            if time.perf_counter() >= end:
                break
        self._ctx.disable(moderngl.BLEND)

    def finish(
        self, summation: Summation, targets: Targets, framebuffer: moderngl.Framebuffer, is_linear: bool
    ) -> None:
        """Smooth what is summed up and write it. is_linear: as light, unbounded, instead of sRGB-encoded."""
        self._ctx.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
        if summation.lens.keeps_layers:
            narrowing = _spread(summation.lens) / math.sqrt(max(summation.round, 1))
            self.passes.smooth(summation.lens, targets, min(narrowing, 1.0))
        framebuffer.use()
        self.passes.present(summation.lens, targets, is_linear)

    def _draw_some(self, field: LightFieldTexture, summation: Summation, targets: Targets, count: int) -> None:
        """Draw the next samples; the pinhole's share comes with the first of a round."""
        lens = summation.lens
        if summation.at == 0:
            self._start_round(field, summation, targets)
        batch = _alike(summation.samples[summation.at :][:count], field)
        layers = {"SHARP": targets.light, "BLURRED": targets.blurred} if lens.keeps_layers else {"": targets.light}
        for layer, target in layers.items():
            if summation.at == 0 and lens.aperture_share < 1:
                self.passes.draw_pinhole(field, lens, summation.within_px, target, targets, layer)
            if batch:
                self.passes.draw_aperture(field, lens, batch, summation.few, target, targets, layer)
        summation.at += len(batch)
        summation.done += max(len(batch), 1)
        if summation.at >= len(summation.samples):
            summation.round, summation.at = summation.round + 1, 0

    def _start_round(self, field: LightFieldTexture, summation: Summation, targets: Targets) -> None:
        lens, place = summation.lens, summation.places[summation.round]
        moved = ViewOffset(lens.stride * place.t, lens.stride * place.s)
        summation.samples, summation.few = [], {}
        if lens.aperture_share > 0:
            # Smoothing narrows with the rounds: in all it stays as much as that of the first, which leave room for it.
            leaves_room = summation.round < _spread(lens) ** 2
            every = lens.samples(field.grid, field.present, moved, is_smoothed=leaves_room)
            summation.few = _few_of(every, lens, field, moved)
            summation.samples = sorted(
                every, key=lambda sample: (sample.wanted not in summation.few, not _is_direct(sample, field))
            )
        if summation.round > 0:
            return
        targets.light.start_sum()
        targets.blurred.start_sum()
        if lens.has_dolly:
            self.passes.update_stand_ins(field)
        if lens.keeps_layers:
            self.passes.find_defocus(field, lens, summation.samples or [_eye_sample(lens, field)], targets)


def _spread(lens: Lens) -> float:
    """How wide smoothing is, as a share of what lies between samples of one round."""
    return HIGHLIGHT_SPREAD if lens.highlight_gain > 0 else 1.0


def _few_of(
    every: list[ApertureSample], lens: Lens, field: LightFieldTexture, moved: ViewOffset
) -> dict[ViewOffset, float]:
    """Weights of every other sample across and down."""
    wanted = {sample.wanted for sample in every}
    coarse = lens.samples(field.grid, field.present, moved, coarser=2, is_smoothed=False)
    few = {sample.wanted: sample.weight for sample in coarse if sample.wanted in wanted}
    return {place: weight / sum(few.values()) for place, weight in few.items()}


def _is_direct(sample: ApertureSample, field: LightFieldTexture) -> bool:
    return field.grid.offset(sample.row, sample.column) == sample.wanted


def _alike(samples: list[ApertureSample], field: LightFieldTexture) -> list[ApertureSample]:
    """The first of them that one program can draw."""
    for i, sample in enumerate(samples):
        if _is_direct(sample, field) != _is_direct(samples[0], field):
            return samples[:i]
    return samples


def _eye_sample(lens: Lens, field: LightFieldTexture) -> ApertureSample:
    """The eye, answered by the present view nearest to it."""
    inside = clamped_to_grid(lens.eye, field.grid)
    row, column = round(inside.t) + field.grid.centre[0], round(inside.s) + field.grid.centre[1]
    stored = nearest_present(field.present)[row, column]
    return ApertureSample(lens.eye, int(stored[0]), int(stored[1]), 1.0)
