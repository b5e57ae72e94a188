"""Pictures as sums of passes over a light field, each with its cameras at other places of the lens and of the pixel."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from dataclasses import dataclass

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.aperture_sampling import SQRT_STEPS, fractions
from iibr_core.beyond.picture_quality import ALONE_NEAR_PX, MAX_SAMPLES, NEAR_PX, OFF_BORDER_PX
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.programs import Program, ProgramCache
from viewer.gpu.refocus.discs import Discs
from viewer.gpu.refocus.picture_lens import Lens
from viewer.gpu.refocus.view_sampling import Samples, nearest_present
from viewer.gpu.render_targets import PictureTargets, clear

COLORS, DISPARITIES, NEAREST_VIEWS = range(3)
"""Texture units."""
MIN_ROWS = 16
"""Smallest number of rows of a step: fewer rows save no time, because a draw has a cost of its own."""
CORNERS = np.array([(0, 0), (1, 1), (1, 0), (0, 1)], np.float32)
"""Corners (s, t) of a cell of the grid: with dolly they answer a pinhole's ray together."""

Rows = tuple[int, int]
"""First row of a target, and the row after the last."""


@dataclass
class ProgressiveAccumulation:
    """A picture being summed up: cameras before camera `at` of pass `pass_index` are drawn, out of `passes` passes.

    field, lens, size_px: of the picture. passes: of the pinhole's picture, which an open lens then blurs; of the
    picture itself without slices. samples: cameras of this pass. done: number of cameras drawn in all passes.
    """

    field: LightFieldTexture
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

    @property
    def drawn_px(self) -> ScreenSize:
        """Size of what the passes draw: with the margin of an open lens."""
        width, height = self.size_px
        return ScreenSize(width + 2 * self.lens.margin_px, height + 2 * self.lens.margin_px)

    @property
    def drawn_lens(self) -> Lens:
        """The lens of the passes."""
        return self.lens.pinhole(self.size_px) if self.lens.slices else self.lens


class Passes:
    """Sums light of a field into targets, blurs it as an open lens does, and writes the finished picture."""

    def __init__(self, ctx: moderngl.Context, programs: ProgramCache) -> None:
        self._ctx = ctx
        self._programs = programs
        self._samples = ctx.buffer(reserve=3 * MAX_SAMPLES * 16)
        self._nearest_views: moderngl.Texture | None = None
        self._discs = Discs(ctx, programs)

    def release(self) -> None:
        """Free every GL object but the programs."""
        self._discs.release()
        self._samples.release()
        if self._nearest_views is not None:
            self._nearest_views.release()

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

    def present(
        self,
        lens: Lens,
        targets: PictureTargets,
        is_linear: bool = False,
        color_space: ColorSpace = SRGB,
        into: moderngl.Framebuffer | None = None,
    ) -> None:
        """Write the finished picture. is_linear: as unclipped light, not encoded. color_space: of the result. into:
        takes the picture in place of the image of the targets.
        """
        (into or targets.image.framebuffer).use()
        self._ctx.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
        switches = {"LINEAR": is_linear, "OTHER_PRIMARIES": lens.color_space != color_space}
        program = self._programs.get("present.frag", switches)
        program.set_primaries(color_space, lens.color_space)
        targets.light.texture.use(0)
        program.set_uniforms(light_sum=0, exposure=2.0**lens.optics.exposure_stops)
        program.draw()

    def _draw_disparity(self, accumulation: ProgressiveAccumulation, target: moderngl.Framebuffer) -> None:
        """Draw the disparity that the eye sees, after a pass."""
        clear(target)
        if accumulation.samples is not None:
            batch, rows = accumulation.samples.part(0, 1), (0, target.size[1])
            self._draw_lens(accumulation, batch, target, rows, is_disparity=True)
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
                self._update_nearest_views(field)
        samples = accumulation.samples
        assert samples is not None
        # The views that answer a pinhole are blended: none is shown alone.
        batch = samples if lens.diameter == 0 else samples.part(at, at + count)
        for rows in _row_bands(ScreenSize(*target.size), pixels_per_step / len(batch)):
            self._ctx.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE)
            self._draw_lens(accumulation, batch, target, rows)
            yield
        accumulation.at, accumulation.done = at + len(batch), accumulation.done + len(batch)
        if accumulation.at >= len(samples):
            accumulation.pass_index, accumulation.at = accumulation.pass_index + 1, 0

    def _draw_lens(
        self,
        accumulation: ProgressiveAccumulation,
        batch: Samples,
        framebuffer: moderngl.Framebuffer,
        rows: Rows,
        is_disparity: bool = False,
    ) -> None:
        """Add the light of at most MAX_SAMPLES cameras of a pass to some rows of the target.

        The search for surfaces depends on all cameras of the pass, so the picture does not depend on the batches.
        is_disparity: disparity is written, not light.
        """
        field, lens, samples = accumulation.field, accumulation.drawn_lens, accumulation.samples
        assert samples is not None
        has_views_to_warp = bool(field.has_disparity.any())
        program = self._programs.get(
            "lens.frag",
            {
                "WARP": has_views_to_warp,
                "NEAR": has_views_to_warp and _are_near(field, lens, samples),
                "DOLLY": lens.has_dolly,
                "GLOSS": field.gloss is not None and lens.optics.gloss is not None,
                "HIGHLIGHTS": lens.highlight_gain > 0,
                "SEEN": is_disparity,
            },
        )
        width, height = framebuffer.size
        across, down = lens.part.width / lens.field_part.width, lens.part.height / lens.field_part.height
        self._set_field(program, field, lens)
        self._set_samples(program, field, lens, batch, accumulation.done, is_disparity)
        program.set_uniforms(pixel_uv=(across / width, down / height), field_part=lens.field_part)
        framebuffer.scissor = 0, rows[0], width, rows[1] - rows[0]
        framebuffer.use()
        # Blending is on for the first light, too: drivers compile a program again for passes that replace.
        self._ctx.enable(moderngl.BLEND)
        self._ctx.blend_func = moderngl.ONE, moderngl.ONE
        program.draw()
        framebuffer.scissor = 0, 0, width, height

    def _update_nearest_views(self, field: LightFieldTexture) -> None:
        """Upload the table of present views, which dolly needs."""
        rows, columns = np.moveaxis(nearest_present(field.present), -1, 0)
        table = np.stack([columns, rows, field.has_disparity[rows, columns], field.layers[rows, columns]], -1)
        if self._nearest_views is not None:
            self._nearest_views.release()
        data = table.astype(np.float32).tobytes()
        self._nearest_views = self._ctx.texture(field.grid[::-1], 4, data, dtype="f4")

    def _set_field(self, program: Program, field: LightFieldTexture, lens: Lens) -> None:
        field.colors.use(COLORS)
        field.disparities.use(DISPARITIES)
        far, near = field.range_px
        program.set_uniforms(
            colors=COLORS,
            disparities=DISPARITIES,
            view_size_px=(field.width, field.height),
            view_step=(1.0, field.row_step),
            nearest=near,
            farthest=far,
            focus_disparity=lens.optics.focus_disparity,
            focus_tilt=lens.optics.focus_tilt,
            focus_range=max(lens.optics.focus_range, 0.0),
            dolly=lens.dolly,
            highlight_gain=lens.highlight_gain,
            part=lens.part,
        )
        if field.gloss is not None and lens.optics.gloss is not None:
            field.gloss.use(program, lens.optics.gloss, (lens.eye.s, lens.eye.t))

    def _set_samples(
        self, program: Program, field: LightFieldTexture, lens: Lens, samples: Samples, first: int, is_one_view: bool
    ) -> None:
        """Write the cameras and their views. is_one_view: with dolly, the nearest corner of a cell answers alone."""
        count = len(samples)
        table = np.zeros((3, MAX_SAMPLES, 4), np.float32)
        cameras, answers, numbers = table
        cameras[:count, :2] = samples.cameras[:, ::-1]
        # All views that answer a pinhole have the same place in the pixel.
        cameras[:count, 2:] = fractions(first // count, 1, SQRT_STEPS[3:]) - 0.5 + OFF_BORDER_PX
        answers[:count, :2] = _to_views(field, lens, samples)[:, ::-1]
        views = tuple(samples.views.T)
        numbers[:count, 0], numbers[:count, 1] = field.layers[views], field.has_disparity[views]
        numbers[:count, 2] = samples.weights
        if lens.has_dolly:
            assert self._nearest_views is not None
            if is_one_view:
                answers[:count, :2] = 0.5
            elif lens.diameter == 0:
                answers[:count, :2], answers[:count, 2] = CORNERS, 1
            else:
                answers[:count, :2] = fractions(first, count, SQRT_STEPS[1::-1])
            self._nearest_views.use(NEAREST_VIEWS)
            row, column = field.grid.centre
            program.set_uniforms(nearest_views=NEAREST_VIEWS, eye_in_grid=(column + lens.eye.s, row + lens.eye.t))
        self._samples.write(table.tobytes())
        program.use_block("Samples", self._samples)
        program.set_uniforms(sample_count=count)


def _to_views(field: LightFieldTexture, lens: Lens, samples: Samples) -> NDArray[np.float64]:
    """Return the offsets (t, s) from the cameras to the views that answer them, in view steps."""
    offsets: NDArray[np.float64] = samples.views - np.array(field.grid.centre) - np.array(lens.eye) - samples.cameras
    return offsets


def _are_near(field: LightFieldTexture, lens: Lens, samples: Samples) -> bool:
    """Return whether every camera is a few pixels of parallax from the view that answers it, a corner of its own cell.

    A single view also shows the background beside what covers it, which takes the whole search.
    """
    if lens.has_dolly:
        return False
    to_views = _to_views(field, lens, samples)
    parallax_px = np.hypot(field.row_step * to_views[:, 0], to_views[:, 1]) * (field.range_px[1] - field.range_px[0])
    max_px = NEAR_PX if field.present.sum() > 1 else ALONE_NEAR_PX
    is_in_cell = bool(np.abs(to_views).max() <= 1)
    return is_in_cell and bool(parallax_px.max() <= max_px)


def _row_bands(size_px: ScreenSize, pixels: float) -> list[Rows]:
    """Return the rows of a target in bands of about so many pixels, at least MIN_ROWS each."""
    width, height = size_px
    if width * height <= pixels:
        return [(0, height)]
    rows = max(int(pixels / width), MIN_ROWS)
    return [(top, min(top + rows, height)) for top in range(0, height, rows)]
