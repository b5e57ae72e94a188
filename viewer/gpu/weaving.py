"""Pictures from several viewpoints in one texture, woven into one picture for a screen, and shown in another window."""

from __future__ import annotations

import math

import moderngl
import numpy as np

from iibr_core.exports.anaglyph import LEFT, RIGHT
from iibr_core.formats.lenticular import MAX_CELLS, Calibration
from iibr_core.scenes.screen_size import ScreenSize
from viewer.gpu.context import GLContext
from viewer.gpu.programs import Program, ProgramCache
from viewer.gpu.render_targets import RenderTarget, sized
from viewer.model.stereo import Weave


class Weaver:
    """Holds the sheet of pictures and the woven picture. screen: the woven picture, rows bottom-up."""

    def __init__(self, ctx: moderngl.Context, programs: ProgramCache) -> None:
        self._ctx, self._programs = ctx, programs
        self._sheet: RenderTarget | None = None
        self.screen: RenderTarget | None = None
        self._tile_px, self._columns = ScreenSize(1, 1), 1

    def prepare(self, weave: Weave) -> None:
        """Make room for the pictures and the screen of a weave."""
        self._columns = math.ceil(math.sqrt(len(weave.eyes)))
        self._tile_px = width, height = weave.eyes[0].size_px
        rows = math.ceil(len(weave.eyes) / self._columns)
        self._sheet = sized(self._ctx, self._sheet, ScreenSize(self._columns * width, rows * height))
        self.screen = sized(self._ctx, self.screen, weave.size_px)

    def tile(self, index: int, drawn_px: ScreenSize) -> moderngl.Framebuffer:
        """Return the framebuffer of the sheet, with the part in view that a picture of this size takes."""
        assert self._sheet is not None
        row, column = divmod(index, self._columns)
        framebuffer: moderngl.Framebuffer = self._sheet.framebuffer
        framebuffer.viewport = column * self._tile_px.width, row * self._tile_px.height, *drawn_px
        return framebuffer

    def weave(self, weave: Weave, drawn_px: ScreenSize) -> None:
        """Weave the pictures, which were drawn at this size."""
        assert self._sheet is not None
        assert self.screen is not None
        program = self._program(weave, drawn_px)
        self._sheet.texture.use(0)
        program.set_uniforms(sheet=0, sheet_columns=self._columns, tile_px=self._tile_px, drawn_px=drawn_px)
        program.set_uniforms(screen_px=weave.size_px, frame_px=weave.frame_px)
        self.screen.framebuffer.use()
        self._ctx.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
        program.draw()

    def release(self) -> None:
        """Free the textures."""
        for target in (self._sheet, self.screen):
            if target is not None:
                target.release()
        self._sheet = self.screen = None

    def _program(self, weave: Weave, drawn_px: ScreenSize) -> Program:
        """Return the weaving program, its uniforms set."""
        if isinstance(weave.arrangement, Calibration):
            return self._lenticular_program(weave.arrangement, len(weave.eyes))
        switch = weave.arrangement.replace("-", "_").upper()
        program = self._programs.get("stereo.frag", {switch: True, "EXACT": drawn_px == self._tile_px})
        left, right = (tuple(matrix.T.ravel().tolist()) for matrix in (LEFT, RIGHT))
        program.set_uniforms(left_seen=left, right_seen=right)
        return program

    def _lenticular_program(self, display: Calibration, views: int) -> Program:
        program = self._programs.get("lenticular.frag")
        program.set_uniforms(
            views=views,
            lenses_per_px=display.lenses_per_px,
            center=display.center % 1.0,
            is_mirrored=display.is_mirrored,
            is_inverted=display.is_inverted,
            emitters=np.resize(display.cells, (3 * MAX_CELLS, 2)).tolist(),
            cells=len(display.cells),
            pattern=display.pattern,
        )
        return program


def show_texture(gl: GLContext, texture: int, size_px: ScreenSize) -> None:
    """Copy a texture (RGBA8) onto the window of a context that is current and shares the texture."""
    framebuffer = gl.ctx.framebuffer([gl.ctx.external_texture(texture, size_px, 4, 0, "f1")])
    gl.ctx.copy_framebuffer(gl.ctx.screen, framebuffer)
    framebuffer.release()
