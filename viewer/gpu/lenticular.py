"""Quilts woven for lenticular displays, subpixel by subpixel."""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.lenticular import MAX_CELLS, Calibration
from iibr_core.formats.quilts import Quilt
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape
from viewer.gpu.light_field_texture import check_fits
from viewer.gpu.programs import ProgramCache
from viewer.gpu.render_targets import RenderTarget


def draw_woven(programs: ProgramCache, texture: moderngl.Texture, quilt: Quilt, calibration: Calibration) -> None:
    """Weave a quilt into the bound framebuffer, which has the size of the display's screen.

    texture: the quilt, rows bottom-up, interpolated linearly.
    """
    program = programs.get("lenticular.frag")
    texture.use(0)
    program.set_uniforms(
        quilt=0,
        tiles=(quilt.columns, quilt.rows),
        tile_px=quilt.tile[::-1],
        screen_px=calibration.screen[::-1],
        lenses_per_px=calibration.lenses_per_px,
        center=calibration.center % 1.0,
        is_mirrored=calibration.is_mirrored,
        is_inverted=calibration.is_inverted,
        emitters=np.resize(calibration.cells, (3 * MAX_CELLS, 2)).tolist(),
        cells=len(calibration.cells),
        pattern=calibration.pattern,
    )
    program.draw()


def weave(
    ctx: moderngl.Context, programs: ProgramCache, pixels: NDArray[np.uint8], quilt: Quilt, calibration: Calibration
) -> NDArray[Any]:
    """Return the picture (H, W, 3) for a display, uint8 at the size of its screen. pixels: the quilt (H, W, 3).

    Raises InputError if the graphics driver cannot hold them.
    """
    screen = calibration.screen
    check_fits(ctx, GridShape(1, 1), max(screen.width, quilt.size.width), max(screen.height, quilt.size.height))
    texture = ctx.texture(quilt.size[::-1], 3, np.ascontiguousarray(pixels[::-1]), alignment=1)
    target = RenderTarget(ctx, ScreenSize(screen.width, screen.height), "f1")
    try:
        target.framebuffer.use()
        ctx.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
        draw_woven(programs, texture, quilt, calibration)
        return target.read()
    finally:
        target.release()
        texture.release()
