"""Draws a light field through a virtual lens: the pinhole view, the aperture sum, and what smooths it, pass by pass.

Everything a picture depends on is a uniform, so a change of focus, aperture or eye costs one drawing and nothing else.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage, GridShape, StoredColors, ViewOffset
from viewer.gpu.context import GLContext
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.programs import Program, load_program
from viewer.gpu.targets import Targets
from viewer.gpu.view_choice import (
    MAX_SOURCES,
    ApertureSample,
    aperture_samples,
    clamped_to_grid,
    nearest_present,
    pinhole_sources,
)
from viewer.state import Optics

MAX_SAMPLES = 512
"""As in shaders/include/samples.glsl; larger apertures are summed in several draws."""

MAX_SEARCH_STEPS = 96
"""Of the pinhole pass: one per pixel of parallax as long as that suffices."""

TILE_PX = 16


@dataclass(frozen=True)
class Lens:
    """What the optics mean for one picture.

    eye: clamped to the grid as far as the aperture sum takes part. aperture_share: of the aperture sum in the picture,
    the rest is the pinhole pass. blur_px: output pixels by which a sample's part of the aperture blurs content one px
    of disparity away from the focus. widest_blur_px: the most that comes to in this field. keeps_layers: whether light
    is kept apart by defocus and smoothed.
    """

    eye: ViewOffset
    diameter: float
    focus_disparity: float
    aperture_share: float
    blur_px: float
    widest_blur_px: float
    keeps_layers: bool
    exposure: float


class Renderer:
    """Draws one light field at a time. Call it only from the thread its context belongs to.

    prefilter: smooth what lies between sparse views; off, it shows them as separate copies, faster.
    """

    def __init__(self, gl: GLContext, prefilter: bool = True) -> None:
        self.gl = gl
        self.ctx = gl.ctx
        self.prefilter = prefilter
        self.field: LightFieldTexture | None = None
        self._programs: dict[tuple[str, tuple[str, ...]], tuple[Program, moderngl.VertexArray]] = {}
        self._samples = self.ctx.buffer(reserve=2 * MAX_SAMPLES * 16)
        self._targets: Targets | None = None

    def open_field(self, grid: GridShape, width: int, height: int, hdr: bool, with_disparity: bool) -> None:
        """Start an empty light field of this size in place of the one before.

        Raises InputError where the graphics driver cannot hold it; the old field then stays.
        """
        field = LightFieldTexture(self.ctx, grid, width, height, hdr, with_disparity)
        if self.field is not None:
            self.field.release()
        self.field = field

    def upload_view(self, row: int, column: int, colors: StoredColors, disparity: FloatImage | None) -> None:
        """Add or replace one view; see LightFieldTexture.upload."""
        self._open_field().upload(row, column, colors, disparity)

    def render(self, optics: Optics, size_px: tuple[int, int], framebuffer: moderngl.Framebuffer | None = None) -> None:
        """Draw the photo, stretched to size_px = (width, height).

        framebuffer: drawn into its current viewport, which should have that size; None draws into the renderer's own
        image (`image_texture`, `read_image`). Before the first view the picture is black. The framebuffer stays bound.
        """
        targets = self._targets_of(size_px)
        self.ctx.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
        lens = self._lens(optics, size_px)
        self._gather(lens, targets)
        if lens.keeps_layers:
            self._smooth(targets)
        (framebuffer or targets.image).use()
        self._present(lens, targets)

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
        for program, quad in self._programs.values():
            quad.release()
            program.release()
        self._programs.clear()
        self._samples.release()
        if self._targets is not None:
            self._targets.release()
            self._targets = None
        if self.field is not None:
            self.field.release()
            self.field = None

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

    def _lens(self, optics: Optics, size_px: tuple[int, int]) -> Lens:
        field = self._open_field()
        diameter = max(optics.aperture_diameter, 0.0)
        share = min(max(diameter - 1.0, 0.0), 1.0)
        inside = clamped_to_grid(optics.eye, field.grid)
        eye = ViewOffset(*(free + share * (held - free) for free, held in zip(optics.eye, inside)))
        blur_px = min(diameter, 1.0) * size_px[0] / field.width  # a sample stands for one view step of the aperture
        widest_px = blur_px * max(abs(edge - optics.focus_disparity) for edge in field.range_px)
        knows_depth = bool(field.has_disparity[field.present].all())
        keeps = self.prefilter and knows_depth and widest_px > 1.0
        exposure = 2.0**optics.exposure_stops
        return Lens(eye, diameter, optics.focus_disparity, share, blur_px, widest_px, keeps, exposure)

    def _gather(self, lens: Lens, targets: Targets) -> None:
        """The pinhole pass, the aperture pass, or for a small aperture a blend of both, into the light targets."""
        light = targets.light_layers if lens.keeps_layers else targets.light
        if not self._open_field().present.any():
            light.framebuffer.clear()
            return
        if lens.keeps_layers:
            self._find_defocus(lens, targets)
        light.use()
        if lens.aperture_share < 1:
            self._draw_pinhole(lens)
            self._add_to_what_is_drawn()
        if lens.aperture_share > 0:
            self._draw_aperture(lens)
        self.ctx.disable(moderngl.BLEND)

    def _add_to_what_is_drawn(self) -> None:
        """The first draw of a pass overwrites (blending and clearing cost time); those after it add."""
        self.ctx.enable(moderngl.BLEND)
        self.ctx.blend_func = moderngl.ONE, moderngl.ONE

    def _draw_pinhole(self, lens: Lens) -> None:
        field = self._open_field()
        program, quad = self._program("pinhole.frag", LAYERS=lens.keeps_layers)
        self._set_field(program, lens)
        sources = pinhole_sources(lens.eye, field.grid, field.present)
        rows = [self._source_row(lens, source.row, source.column, source.weight) for source in sources]
        steps = [self._search_steps(lens, source.row, source.column) for source in sources]
        missing = MAX_SOURCES - len(sources)
        program.set_uniforms(
            share=1.0 - lens.aperture_share,
            source_count=len(sources),
            sources=[*rows, *[(0.0,) * 4] * missing],
            search_steps=[*steps, *[0] * missing],
        )
        quad.render(moderngl.TRIANGLES, vertices=3)

    def _source_row(self, lens: Lens, row: int, column: int, weight: float) -> tuple[float, ...]:
        field = self._open_field()
        there = field.grid.offset(row, column)
        delta = (there.s - lens.eye.s) / field.width, (there.t - lens.eye.t) / field.height
        return (*delta, float(field.layer(row, column)), weight)

    def _search_steps(self, lens: Lens, row: int, column: int) -> int:
        field = self._open_field()
        if not field.has_disparity[row, column]:
            return 0
        there = field.grid.offset(row, column)
        parallax_px = math.hypot(there.s - lens.eye.s, there.t - lens.eye.t) * (field.range_px[1] - field.range_px[0])
        return min(max(math.ceil(parallax_px), 2), MAX_SEARCH_STEPS)

    def _draw_aperture(self, lens: Lens) -> None:
        field = self._open_field()
        samples = aperture_samples(lens.eye, lens.diameter, field.grid, field.present)
        detours = self._need_detours(samples)
        program, quad = self._program("aperture.frag", LAYERS=lens.keeps_layers, DETOURS=detours)
        self._set_field(program, lens)
        for first in range(0, len(samples), MAX_SAMPLES):
            batch = samples[first : first + MAX_SAMPLES]
            self._set_samples(program, lens, batch)
            program.set_uniforms(share=lens.aperture_share * sum(sample.weight for sample in batch))
            quad.render(moderngl.TRIANGLES, vertices=3)
            self._add_to_what_is_drawn()

    def _need_detours(self, samples: list[ApertureSample]) -> bool:
        grid = self._open_field().grid
        return any(grid.offset(sample.row, sample.column) != sample.wanted for sample in samples)

    def _find_defocus(self, lens: Lens, targets: Targets) -> None:
        """Fill the tiles with the widest blur around each."""
        field = self._open_field()
        if lens.aperture_share > 0:
            samples = aperture_samples(lens.eye, lens.diameter, field.grid, field.present)
        else:
            row, column = nearest_to(lens.eye, field.grid, field.present)
            samples = [ApertureSample(lens.eye, row, column, 1.0)]
        samples = samples[:: math.ceil(len(samples) / MAX_SAMPLES)]
        program, quad = self._program("defocus_tiles.frag", DETOURS=self._need_detours(samples))
        self._set_field(program, lens)
        self._set_samples(program, lens, samples)
        taps = min(max(math.ceil(math.sqrt(64 / len(samples))), 2), 8)
        program.set_uniforms(taps=taps, tile_uv=(TILE_PX / targets.size_px[0], TILE_PX / targets.size_px[1]))
        targets.tiles.use()
        quad.render(moderngl.TRIANGLES, vertices=3)

        program, quad = self._program("widen_tiles.frag")
        targets.tiles.textures[0].use(0)
        program.set_uniforms(tiles=0, reach=min(math.ceil((lens.widest_blur_px / 2 + TILE_PX / 2) / TILE_PX), 4))
        targets.wide_tiles.use()
        quad.render(moderngl.TRIANGLES, vertices=3)

    def _smooth(self, targets: Targets) -> None:
        width, height = targets.size_px
        program, quad = self._program("smooth.frag")
        targets.wide_tiles.textures[0].use(2)
        program.set_uniforms(front_layer=0, back_layer=1, tiles=2)
        across = targets.light_layers.textures[1:], targets.half_across, (1 / width, 0.0)
        down = targets.half_across.textures, targets.half_smooth, (0.0, 1 / height)
        for (front, back), target, direction in (across, down):
            front.use(0)
            back.use(1)
            program.set_uniforms(px=direction)
            target.use()
            quad.render(moderngl.TRIANGLES, vertices=3)

    def _present(self, lens: Lens, targets: Targets) -> None:
        program, quad = self._program("present.frag", LAYERS=lens.keeps_layers)
        light = targets.light_layers.textures
        light[0].use(0)
        program.set_uniforms(focus_layer=0, exposure=lens.exposure)
        if lens.keeps_layers:
            light[2].use(1)
            targets.half_smooth.textures[0].use(2)
            targets.half_smooth.textures[1].use(3)
            program.set_uniforms(back_layer=1, smooth_front=2, smooth_back=3)
        quad.render(moderngl.TRIANGLES, vertices=3)

    def _set_field(self, program: Program, lens: Lens) -> None:
        field = self._open_field()
        field.colors.use(0)
        field.disparities.use(1)
        far, near = field.range_px
        values: dict[str, Any] = {
            "colors": 0,
            "disparities": 1,
            "view_size_px": (field.width, field.height),
            "nearest": near,
            "farthest": far,
            "focus_disparity": lens.focus_disparity,
            "defocus_px_from_depth": (lens.blur_px * (near - far), lens.blur_px * (far - lens.focus_disparity)),
        }
        program.set_uniforms(**{name: value for name, value in values.items() if name in program.declared})

    def _set_samples(self, program: Program, lens: Lens, samples: list[ApertureSample]) -> None:
        field = self._open_field()
        table = np.zeros((2, MAX_SAMPLES, 4), np.float32)
        for i, (wanted, row, column, weight) in enumerate(samples):
            stored = field.grid.offset(row, column)
            shift = -lens.focus_disparity
            table[0, i] = (
                shift * (wanted.s - lens.eye.s) / field.width,
                shift * (wanted.t - lens.eye.t) / field.height,
                field.layer(row, column),
                weight,
            )
            detour = (stored.s - wanted.s) / field.width, (stored.t - wanted.t) / field.height
            table[1, i, :3] = (*detour, float(field.has_disparity[row, column]))
        self._samples.write(table.tobytes())
        self._samples.bind_to_uniform_block(0)
        program.bind_block("Samples", 0)
        program.set_uniforms(sample_count=len(samples))

    def _program(self, fragment: str, **switches: bool) -> tuple[Program, moderngl.VertexArray]:
        """The program of a pass, with those switches that are on as defines; compiled when first needed."""
        defines = tuple(name for name, is_on in switches.items() if is_on)
        key = fragment, defines
        if key not in self._programs:
            program = load_program(self.ctx, "fullscreen.vert", fragment, dict.fromkeys(defines, 1))
            self._programs[key] = program, self.ctx.vertex_array(program.program, [])
        return self._programs[key]


def nearest_to(eye: ViewOffset, grid: GridShape, present: NDArray[np.bool_]) -> tuple[int, int]:
    """Index of the present view nearest to the eye."""
    v, u = clamped_to_grid(eye, grid)
    row, column = nearest_present(present)[round(v) + grid.centre[0], round(u) + grid.centre[1]]
    return int(row), int(column)
