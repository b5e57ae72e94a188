"""The passes over a light field: each sets its uniforms and draws one triangle into a target. What is drawn when, the
renderer decides.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from typing import Any

import moderngl
import numpy as np

from iibr_core.types import SRGB, ColorSpace, ViewOffset
from viewer.gpu.light_field_texture import BLOCK_PX, LightFieldTexture
from viewer.gpu.programs import Program, ProgramCache, set_primaries
from viewer.gpu.refocus.picture_cells import PictureCell, cells_between_views, covering_pixels, pixels_of
from viewer.gpu.refocus.picture_lens import Lens, pass_limits
from viewer.gpu.refocus.view_sampling import (
    MAX_SOURCES,
    ApertureSample,
    nearest_present,
    pinhole_sources,
    pinhole_weights,
)
from viewer.gpu.render_targets import RenderTargets

MAX_SAMPLES = 512
"""As in shaders/include/samples.glsl; larger apertures are summed in several draws."""

MAX_SEARCH_STEPS = 96
"""Of the pinhole pass: one per pixel of parallax as long as that suffices."""

OFF_BORDER_PX = 1 / 256
"""Halfway between views a look-up may hit the border between two texels: rounding must not decide which one is read."""

TILE_PX = 16
MAX_TILE_TAPS = 8

UNITS = {"colors": 0, "disparities": 1, "tiles": 2, "fallback_views": 3, "blocks": 4, "wide_tiles": 5}
SPANS = "intervals_of_0_and_1", "intervals_of_2_and_3"


class Passes:
    """Draws parts of a picture. adaptive: whether tiles leave out what they have no use for."""

    def __init__(self, ctx: moderngl.Context, programs: ProgramCache) -> None:
        self._ctx = ctx
        self._programs = programs
        self._samples = ctx.buffer(reserve=2 * MAX_SAMPLES * 16)
        self._fallback_views: moderngl.Texture | None = None
        self.adaptive = True

    def release(self) -> None:
        """Free every GL object of its own."""
        self._samples.release()
        if self._fallback_views is not None:
            self._fallback_views.release()

    def draw_pinhole(
        self,
        field: LightFieldTexture,
        lens: Lens,
        within_px: ViewOffset,
        targets: RenderTargets,
        rows: PictureCell,
    ) -> Iterator[None]:
        """Add the share of the pinhole view in some rows of the target, a program a step; between two, anything else
        may be drawn.

        within_px: where in a pixel of the target it is asked which surface shows, from the middle.
        """
        kinds = ("FLAT", "EDGES") if self.adaptive and field.has_disparity.any() else ("",)
        target = targets.sum_of(lens.keeps_layers)
        size_px = target.framebuffer.size
        for cell in cells_between_views(field.grid, lens):
            drawn = cell.in_target(lens.part).within(rows)
            if drawn is None:
                continue
            if "FLAT" in kinds:
                self._find_march_intervals(field, lens, cell, drawn, targets)
                yield
            for kind in kinds:
                target.framebuffer.scissor = pixels_of(drawn, *size_px)
                target.add()
                self._draw_pinhole_tiles(field, lens, cell, drawn, within_px, targets, kind)
                target.framebuffer.scissor = 0, 0, *size_px
                yield

    def _draw_pinhole_tiles(
        self,
        field: LightFieldTexture,
        lens: Lens,
        cell: PictureCell,
        drawn: PictureCell,
        within_px: ViewOffset,
        targets: RenderTargets,
        kind: str,
    ) -> None:
        """Draw a cell, or those of its tiles that are of a kind: "FLAT" or "EDGES". drawn: what of it is asked for."""
        program, quad = self._programs.get(
            "pinhole.frag",
            _switches(lens, _layers(lens), lens.has_dolly and "DOLLY", kind, _has_gloss(field, lens) and "GLOSS"),
        )
        width, height = targets.size_px
        self._set_field(program, field, lens)
        self._set_sources(program, field, lens, cell)
        program.set_uniforms(share=1.0 - lens.aperture_share)
        pixel_uv = lens.part.width / width, lens.part.height / height
        within = (within_px.s + OFF_BORDER_PX) * pixel_uv[0], (within_px.t + OFF_BORDER_PX) * pixel_uv[1]
        program.set_uniforms(within_pixel=within)
        if kind:
            for unit, (name, texture) in enumerate(zip(SPANS, targets.spans.textures), start=len(UNITS)):
                texture.use(unit)
                program.set_uniform(name, unit)
        if not kind:
            quad.render(moderngl.TRIANGLES, vertices=3)
            return
        across, down = targets.spans.framebuffer.size
        # A row of tiles more at either end: rounding must not decide which are there; the scissor cuts them off.
        first, last = max(math.floor(drawn.top * down) - 1, 0), min(math.ceil(drawn.bottom * down) + 1, down)
        quad.render(moderngl.TRIANGLES, vertices=6 * across * (last - first), first=6 * across * first)

    def _find_march_intervals(
        self, field: LightFieldTexture, lens: Lens, cell: PictureCell, drawn: PictureCell, targets: RenderTargets
    ) -> None:
        """Fill the tiles of a cell with the first and the last step of each march that can find a surface. drawn: what
        of it is asked for.
        """
        program, quad = self._programs.get("march_intervals.frag", _switches(lens, "", lens.has_dolly and "DOLLY"))
        self._set_field(program, field, lens)
        self._set_sources(program, field, lens, cell)
        self._set_blocks(program, field, targets)
        width, height = targets.size_px
        program.set_uniforms(pixel_uv=(lens.part.width / width, lens.part.height / height))
        target = targets.spans
        target.framebuffer.scissor = covering_pixels(drawn, *target.framebuffer.size)
        self._ctx.disable(moderngl.BLEND)
        target.use()
        quad.render(moderngl.TRIANGLES, vertices=3)

    def _set_sources(self, program: Program, field: LightFieldTexture, lens: Lens, cell: PictureCell) -> None:
        """The views that a cell of the picture is made of; with dolly, their weights at its corners."""
        middle = lens.eye_at((cell.left + cell.right) / 2, (cell.top + cell.bottom) / 2)
        sources = pinhole_sources(middle, field.grid, field.present)[: lens.most_sources]
        in_all = sum(source.weight for source in sources)
        missing = MAX_SOURCES - len(sources)
        rows, steps = [], []
        for row, column, weight in sources:
            there = field.grid.offset(row, column)
            rows.append((there.s - lens.eye.s, there.t - lens.eye.t, float(field.layer(row, column)), weight / in_all))
            steps.append(_search_steps(field, lens, there, cell) if field.has_disparity[row, column] else 0)
        program.set_uniforms(
            source_count=len(sources),
            sources=[*rows, *[(0.0,) * 4] * missing],
            search_steps=[*steps, *[0] * missing],
        )
        if "cell" in program.declared and lens.has_dolly:
            corners = [lens.eye_at(u, v) for v in (cell.top, cell.bottom) for u in (cell.left, cell.right)]
            weights = pinhole_weights(sources, corners, field.grid)
            program.set_uniforms(
                cell=tuple(cell), corner_weights=[*map(tuple, weights.tolist()), *[(0.0,) * 4] * missing]
            )

    def draw_aperture(
        self,
        field: LightFieldTexture,
        lens: Lens,
        samples: list[ApertureSample],
        sparse: dict[ViewOffset, float],
        targets: RenderTargets,
        rows: PictureCell,
        passes: int,
    ) -> None:
        """Add samples of the lens, at most MAX_SAMPLES, to what has not all its passes. rows: see `draw_pinhole`.

        sparse: weights of the samples that suffice where all is sharp; those among `samples` must come first. passes:
        that are drawn before this one.
        """
        tiles = self.adaptive and lens.keeps_layers
        reprojects = _needs_reprojection(field, lens, samples)
        program, quad = self._programs.get(
            "aperture.frag",
            _switches(
                lens,
                _layers(lens),
                tiles and "TILES",
                reprojects and "REPROJECT",
                reprojects and lens.has_dolly and "DOLLY",
                _has_gloss(field, lens) and "GLOSS",
            ),
        )
        self._set_field(program, field, lens)
        self._set_samples(program, field, lens, samples, sparse)
        target = targets.sum_of(lens.keeps_layers)
        program.set_uniforms(share=lens.aperture_share)
        if tiles:
            self._bind(targets.tiles.textures[0], "tiles")
            self._bind(targets.wide_tiles.textures[0], "wide_tiles")
            sparse_count = sum(sample.wanted in sparse for sample in samples)
            sparse_up_to_px = lens.sparse_up_to_px if sparse else 0.0  # of few samples none may be one of every other
            _set_declared(program, tiles=UNITS["tiles"], sparse_count=sparse_count, sparse_up_to_px=sparse_up_to_px)
            _set_declared(program, wide_tiles=UNITS["wide_tiles"], passes=float(passes))
        target.framebuffer.scissor = pixels_of(rows, *target.framebuffer.size)
        target.add()
        quad.render(moderngl.TRIANGLES, vertices=3)
        target.framebuffer.scissor = 0, 0, *target.framebuffer.size

    def find_defocus(
        self, field: LightFieldTexture, lens: Lens, samples: list[ApertureSample], targets: RenderTargets
    ) -> Iterator[None]:
        """Fill the tiles with the widest blur in each, and around each, and with the passes that each is drawn in, in
        steps as `draw_pinhole`.
        """
        self._ctx.disable(moderngl.BLEND)
        # Stored views tell the blur without reprojection, if they are most of the samples.
        direct = [sample for sample in samples if field.grid.offset(sample.row, sample.column) == sample.wanted]
        samples = direct if 2 * len(direct) > len(samples) else samples
        samples = samples[:: math.ceil(len(samples) / MAX_SAMPLES)]
        reprojects = _needs_reprojection(field, lens, samples)
        program, quad = self._programs.get(
            "defocus_tiles.frag",
            _switches(lens, "", reprojects and "REPROJECT", reprojects and lens.has_dolly and "DOLLY"),
        )
        self._set_field(program, field, lens)
        self._set_samples(program, field, lens, samples, {})
        self._set_blocks(program, field, targets)
        across, down = targets.tiles.framebuffer.size
        tile_px = max(lens.part.width * field.width / across, lens.part.height * field.height / down)
        taps = 1 + math.ceil(tile_px / BLOCK_PX)
        program.set_uniforms(taps=min(taps, MAX_TILE_TAPS))
        targets.tiles.use()
        quad.render(moderngl.TRIANGLES, vertices=3)
        yield

        # Light spreads over tile borders by half the widest blur.
        program, quad = self._programs.get("widen_tiles.frag")
        self._bind(targets.tiles.textures[0], "tiles")
        reach = min(math.ceil((lens.widest_blur_px / 2 + TILE_PX / 2) / TILE_PX), 4)
        program.set_uniforms(tiles=UNITS["tiles"], reach=reach, **pass_limits(self._finishes_tiles(lens)))
        targets.wide_tiles.use()
        quad.render(moderngl.TRIANGLES, vertices=3)
        yield

    def weigh_alike(self, lens: Lens, targets: RenderTargets, passes: int) -> None:
        """Let tiles that had all their passes before the last of these weigh as much as those that got it."""
        if passes == 1 or not self._finishes_tiles(lens):
            return
        program, quad = self._programs.get("finished_tiles.frag")
        self._bind(targets.wide_tiles.textures[0], "tiles")
        program.set_uniforms(tiles=UNITS["tiles"], passes=float(passes))
        targets.layers.sums.multiply()
        quad.render(moderngl.TRIANGLES, vertices=3)

    def smooth(self, lens: Lens, targets: RenderTargets, passes: int) -> None:
        """Spread the blurred layers over what lies between samples. passes: that are drawn."""
        self._ctx.disable(moderngl.BLEND)
        program, quad = self._programs.get("smooth.frag")
        targets.wide_tiles.textures[0].use(2)
        program.set_uniforms(foreground_layer=0, background_layer=1, tiles=2, empty_up_to_px=lens.sharp_up_to_px[0])
        program.set_uniforms(passes=float(passes), spread=lens.smoothing_spread)
        layers = targets.layers
        across = layers.sums.textures[1:], layers.across, (1, 0)
        down = layers.across.textures, layers.smooth, (0, 1)
        for (foreground, background), target, direction in (across, down):
            foreground.use(0)
            background.use(1)
            width, height = target.framebuffer.size
            program.set_uniforms(texel_step=(direction[0] / width, direction[1] / height))
            target.use()
            quad.render(moderngl.TRIANGLES, vertices=3)

    def present(
        self,
        lens: Lens,
        targets: RenderTargets,
        passes: int,
        is_linear: bool,
        color_space: ColorSpace = SRGB,
    ) -> None:
        """The finished picture, into the framebuffer in use. passes: that are drawn. is_linear: as light,
        unbounded, not encoded. color_space: of the result.
        """
        self._ctx.disable(moderngl.BLEND)
        converts = lens.color_space != color_space and "OTHER_PRIMARIES"
        switches = _layers(lens), is_linear and "LINEAR", converts
        program, quad = self._programs.get("present.frag", tuple(switch for switch in switches if switch))
        set_primaries(program, color_space, lens.color_space)
        targets.light.textures[0].use(0)
        program.set_uniforms(focus_layer=0, exposure=lens.exposure)
        if lens.keeps_layers:
            layers = (*targets.layers.sums.textures[1:], *targets.layers.smooth.textures)
            for unit, texture in enumerate((*layers, targets.wide_tiles.textures[0]), start=1):
                texture.use(unit)
            program.set_uniforms(
                foreground_layer=1, background_layer=2, smooth_foreground=3, smooth_background=4, tiles=5
            )
            program.set_uniforms(passes=float(passes), spread=lens.smoothing_spread)
        quad.render(moderngl.TRIANGLES, vertices=3)

    def update_fallback_views(self, field: LightFieldTexture) -> None:
        """Tell the shaders which views are there; needed for dolly."""
        rows, columns = field.grid
        table = np.zeros((rows, columns, 4), np.float32)
        nearest = nearest_present(field.present)
        table[..., :2] = nearest[..., ::-1]
        table[..., 2] = field.has_disparity[nearest[..., 0], nearest[..., 1]]
        table[..., 3] = [[field.layer(int(row), int(column)) for row, column in line] for line in nearest]
        if self._fallback_views is None or self._fallback_views.size != (columns, rows):
            if self._fallback_views is not None:
                self._fallback_views.release()
            self._fallback_views = self._ctx.texture((columns, rows), 4, dtype="f4")
        self._fallback_views.write(table.tobytes())

    def _finishes_tiles(self, lens: Lens) -> bool:
        """Whether tiles that have their passes get no more; the pinhole's share comes with every pass."""
        return self.adaptive and lens.aperture_share == 1

    def _bind(self, texture: moderngl.Texture, name: str) -> None:
        texture.use(UNITS[name])

    def _set_field(self, program: Program, field: LightFieldTexture, lens: Lens) -> None:
        field.colors.use(UNITS["colors"])
        field.disparities.use(UNITS["disparities"])
        far, near = field.range_px
        _set_declared(
            program,
            colors=UNITS["colors"],
            disparities=UNITS["disparities"],
            view_size_px=(field.width, field.height),
            nearest=near,
            farthest=far,
            focus_disparity=lens.optics.focus_disparity,
            focus_tilt=lens.optics.focus_tilt,
            focus_range=lens.focus_range,
            dolly=lens.dolly,
            highlight_gain=lens.highlight_gain,
            blur_px=lens.blur_px,
            sharp_up_to_px=lens.sharp_up_to_px,
            barrel=lens.barrel(field.height / field.width),
            part=lens.part,
            sample_width=min(float(lens.stride), lens.diameter),
        )
        if field.gloss is not None and lens.optics.gloss is not None and "gloss_surface" in program.declared:
            field.gloss.use(program, lens.optics.gloss, (lens.eye.s, lens.eye.t))

    def _set_blocks(self, program: Program, field: LightFieldTexture, targets: RenderTargets) -> None:
        across, down = targets.tiles.framebuffer.size
        field.blocks.use(UNITS["blocks"])
        program.set_uniforms(blocks=UNITS["blocks"], block_px=float(BLOCK_PX), tile_uv=(1 / across, 1 / down))

    def _set_samples(
        self,
        program: Program,
        field: LightFieldTexture,
        lens: Lens,
        samples: list[ApertureSample],
        sparse: dict[ViewOffset, float],
    ) -> None:
        table = np.zeros((2, MAX_SAMPLES, 4), np.float32)
        for i, (wanted, row, column, weight) in enumerate(samples):
            stored = field.grid.offset(row, column)
            table[0, i] = wanted.s - lens.eye.s, wanted.t - lens.eye.t, field.layer(row, column), weight
            reprojection = stored.s - wanted.s, stored.t - wanted.t
            table[1, i] = (*reprojection, float(field.has_disparity[row, column]), sparse.get(wanted, 0.0))
        self._samples.write(table.tobytes())
        self._samples.bind_to_uniform_block(0)
        program.bind_block("Samples", 0)
        program.set_uniforms(sample_count=len(samples))
        if lens.has_dolly and "fallback_views" in program.declared:
            assert self._fallback_views is not None
            self._bind(self._fallback_views, "fallback_views")
            row, column = field.grid.centre
            _set_declared(
                program, fallback_views=UNITS["fallback_views"], eye_in_grid=(column + lens.eye.s, row + lens.eye.t)
            )


def _switches(lens: Lens, *names: str | bool) -> tuple[str, ...]:
    by_lens = (
        "RANGE" if lens.focus_range > 0 else "",
        "HIGHLIGHTS" if lens.highlight_gain > 0 else "",
        "CAT_EYE" if lens.optics.aperture_shape.kind == "cat_eye" else "",
    )
    return tuple(str(name) for name in (*names, *by_lens) if name)


def _layers(lens: Lens) -> str:
    return "LAYERS" if lens.keeps_layers else ""


def _has_gloss(field: LightFieldTexture, lens: Lens) -> bool:
    return field.gloss is not None and lens.optics.gloss is not None


def _needs_reprojection(field: LightFieldTexture, lens: Lens, samples: list[ApertureSample]) -> bool:
    if lens.has_dolly or lens.focus_range > 0:
        return True
    return any(field.grid.offset(sample.row, sample.column) != sample.wanted for sample in samples)


def _set_declared(program: Program, **values: Any) -> None:
    program.set_uniforms(**{name: value for name, value in values.items() if name in program.declared})


def _search_steps(field: LightFieldTexture, lens: Lens, view: ViewOffset, cell: PictureCell) -> int:
    """One per pixel of parallax, for the pixel of the cell whose ray crosses the grid farthest from the view."""
    rays = [lens.eye_at(u, v) for u in (cell.left, cell.right) for v in (cell.top, cell.bottom)]
    distance = max(math.hypot(view.s - ray.s, view.t - ray.t) for ray in rays)
    parallax_px = distance * (field.range_px[1] - field.range_px[0])
    return min(max(math.ceil(parallax_px), 2), MAX_SEARCH_STEPS)
