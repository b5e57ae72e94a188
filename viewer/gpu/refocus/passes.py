"""The passes over a light field: each sets its uniforms and draws one triangle into a target. What is drawn when, the
renderer decides.
"""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np

from iibr_core.beyond.aperture_sampling import SQRT_STEPS, fractions
from iibr_core.types import SRGB, ColorSpace
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.programs import Program, ProgramCache, set_primaries
from viewer.gpu.refocus.picture_lens import BARREL_EDGE, Lens
from viewer.gpu.refocus.view_sampling import Samples, nearest_present
from viewer.gpu.render_targets import RenderTargets

MAX_SAMPLES = 256
"""As in shaders/lens.frag; more views without disparity are summed in several draws."""

OFF_BORDER_PX = 1 / 256
"""Halfway between views a look-up may hit the border between two texels: rounding must not decide which one is read."""

NEAR_PX = 32.0
"""Parallax between a camera and its view, at most, up to which three steps find the surface: see first_hit.glsl."""

ALONE_NEAR_PX = 2.0
"""The same where there is only one view."""

UNITS = {"colors": 0, "disparities": 1, "nearest_views": 2}
CORNERS = np.array([(0, 0), (1, 1), (1, 0), (0, 1)], np.float32)
"""Corners (s, t) of a cell of the grid: with dolly they answer a pinhole's ray together."""

Rows = tuple[int, int]
"""First row of a target, and the one after the last."""


class Passes:
    """Draws parts of a picture."""

    def __init__(self, ctx: moderngl.Context, programs: ProgramCache) -> None:
        self._ctx = ctx
        self._programs = programs
        self._samples = ctx.buffer(reserve=3 * MAX_SAMPLES * 16)
        self._nearest_views: moderngl.Texture | None = None

    def release(self) -> None:
        """Free every GL object of its own."""
        self._samples.release()
        if self._nearest_views is not None:
            self._nearest_views.release()

    def draw_lens(
        self,
        field: LightFieldTexture,
        lens: Lens,
        samples: Samples,
        first: int,
        cell: float,
        targets: RenderTargets,
        rows: Rows,
    ) -> None:
        """Add the light of at most MAX_SAMPLES cameras to some rows of the target. first: number of the first
        camera. cell: side of the square of the aperture that a camera stands for, view steps.
        """
        warps = bool(field.has_disparity.any())
        has_gloss = field.gloss is not None and lens.optics.gloss is not None
        program, quad = self._programs.get(
            "lens.frag",
            switches(
                WARP=warps,
                NEAR=warps and _are_near(field, lens, samples),
                RANGE=lens.optics.focus_range > 0,
                DOLLY=lens.has_dolly,
                GLOSS=has_gloss,
                HIGHLIGHTS=lens.highlight_gain > 0,
                CAT_EYE=lens.optics.aperture_shape.kind == "cat_eye",
            ),
        )
        width, height = targets.size_px
        self._set_field(program, field, lens)
        self._set_samples(program, field, lens, samples, first)
        across, down = lens.part.width / lens.field_part.width, lens.part.height / lens.field_part.height
        _set_declared(program, cell_views=cell, pixel_uv=(across / width, down / height), field_part=lens.field_part)
        target = targets.light
        target.framebuffer.scissor = 0, rows[0], width, rows[1] - rows[0]
        target.add()
        quad.render(moderngl.TRIANGLES, vertices=3)
        target.framebuffer.scissor = 0, 0, width, height

    def present(self, lens: Lens, targets: RenderTargets, is_linear: bool, color_space: ColorSpace = SRGB) -> None:
        """The finished picture, into the framebuffer in use. is_linear: as light, unbounded, not encoded.
        color_space: of the result.
        """
        self._ctx.disable(moderngl.BLEND)
        converts = lens.color_space != color_space
        program, quad = self._programs.get("present.frag", switches(LINEAR=is_linear, OTHER_PRIMARIES=converts))
        set_primaries(program, color_space, lens.color_space)
        targets.light.textures[0].use(0)
        program.set_uniforms(light_sum=0, exposure=lens.exposure)
        quad.render(moderngl.TRIANGLES, vertices=3)

    def update_nearest_views(self, field: LightFieldTexture) -> None:
        """Tell the shaders which views are there; needed for dolly."""
        rows, columns = field.grid
        table = np.zeros((rows, columns, 4), np.float32)
        nearest = nearest_present(field.present)
        table[..., :2] = nearest[..., ::-1]
        table[..., 2] = field.has_disparity[nearest[..., 0], nearest[..., 1]]
        table[..., 3] = field.layers[nearest[..., 0], nearest[..., 1]]
        if self._nearest_views is None or self._nearest_views.size != (columns, rows):
            if self._nearest_views is not None:
                self._nearest_views.release()
            self._nearest_views = self._ctx.texture((columns, rows), 4, dtype="f4")
        self._nearest_views.write(table.tobytes())

    def _set_field(self, program: Program, field: LightFieldTexture, lens: Lens) -> None:
        field.colors.use(UNITS["colors"])
        field.disparities.use(UNITS["disparities"])
        far, near = field.range_px
        aspect = field.height / field.width * lens.field_part.width / lens.field_part.height
        _set_declared(
            program,
            colors=UNITS["colors"],
            disparities=UNITS["disparities"],
            view_size_px=(field.width, field.height),
            nearest=near,
            farthest=far,
            focus_disparity=lens.optics.focus_disparity,
            focus_tilt=lens.optics.focus_tilt,
            focus_range=max(lens.optics.focus_range, 0.0),
            dolly=lens.dolly,
            highlight_gain=lens.highlight_gain,
            barrel=lens.barrel(aspect),
            barrel_edge=max(BARREL_EDGE * lens.diameter, 1e-6),
            part=lens.part,
        )
        if field.gloss is not None and lens.optics.gloss is not None and "gloss_surface" in program.declared:
            field.gloss.use(program, lens.optics.gloss, (lens.eye.s, lens.eye.t))

    def _set_samples(
        self, program: Program, field: LightFieldTexture, lens: Lens, samples: Samples, first: int
    ) -> None:
        count = len(samples)
        table = np.zeros((3, MAX_SAMPLES, 4), np.float32)
        cameras, answers, numbers = table
        cameras[:count, :2] = samples.cameras[:, ::-1]
        # All views that answer a pinhole are asked at the same place of the pixel.
        numbered = (first // count, 1) if lens.diameter == 0 else (first, count)
        cameras[:count, 2:] = fractions(*numbered, SQRT_STEPS[3:]) - 0.5 + OFF_BORDER_PX
        offsets = samples.views - np.array(field.grid.centre)
        answers[:count, :2] = (offsets - np.array(lens.eye) - samples.cameras)[:, ::-1]
        numbers[:count, 0] = field.layers[tuple(samples.views.T)]
        numbers[:count, 1] = field.has_disparity[tuple(samples.views.T)]
        numbers[:count, 2] = samples.weights
        if lens.has_dolly and "nearest_views" in program.declared:
            assert self._nearest_views is not None
            if lens.diameter == 0:
                answers[:count, :2], answers[:count, 2] = CORNERS, 1
            else:
                answers[:count, :2] = fractions(first, count, SQRT_STEPS[1::-1])
            self._nearest_views.use(UNITS["nearest_views"])
            row, column = field.grid.centre
            _set_declared(
                program, nearest_views=UNITS["nearest_views"], eye_in_grid=(column + lens.eye.s, row + lens.eye.t)
            )
        self._samples.write(table.tobytes())
        self._samples.bind_to_uniform_block(0)
        program.bind_block("Samples", 0)
        program.set_uniforms(sample_count=count)


def switches(**names: bool) -> tuple[str, ...]:
    """Names of the switches of a program that are on."""
    return tuple(name for name, is_on in names.items() if is_on)


def _are_near(field: LightFieldTexture, lens: Lens, samples: Samples) -> bool:
    """Whether all cameras are a few pixels of parallax from the views that answer them: corners of their own cells.

    Where a single view stands in for all, what it does not see is shown too: that takes the whole search.
    """
    if lens.has_dolly:
        return False
    to_views = samples.views - np.array(field.grid.centre) - np.array(lens.eye) - samples.cameras
    parallax_px = np.hypot(*to_views.T) * (field.range_px[1] - field.range_px[0])
    most_px = NEAR_PX if field.present.sum() > 1 else ALONE_NEAR_PX
    is_in_cell = bool(np.abs(to_views).max() <= 1)
    return is_in_cell and (parallax_px + np.hypot(*samples.cameras.T) * 2 * lens.optics.focus_range).max() <= most_px


def _set_declared(program: Program, **values: Any) -> None:
    program.set_uniforms(**{name: value for name, value in values.items() if name in program.declared})
