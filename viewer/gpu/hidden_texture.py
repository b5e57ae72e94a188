"""The surface behind the photo's on the graphics card: an open lens shows it past the edges of the photo's surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import moderngl
import numpy as np

from iibr_core.color import linear_from_srgb
from iibr_core.types import image_size
from viewer.gpu.gloss_texture import Shared
from viewer.gpu.programs import Program

if TYPE_CHECKING:
    from iibr_core.beyond.hidden_surfaces import HiddenSurface


class HiddenTexture(Shared):
    """A hidden surface as textures, see shaders/surfaces.frag."""

    def __init__(self, ctx: moderngl.Context, surface: HiddenSurface) -> None:
        (height, width), colors = image_size(surface.disparity), surface.colors
        texels = np.empty((height, width, 4), np.float16)
        texels[..., :3] = np.minimum(np.sqrt(linear_from_srgb(colors)), np.finfo(np.float16).max)
        texels[..., 3] = surface.mask
        disparity = np.ascontiguousarray(surface.disparity, np.float32)
        self._size = float(width), float(height)
        self._colors: Any = ctx.texture((width, height), 4, texels.tobytes(), dtype="f2", alignment=1)
        self._disparity: Any = ctx.texture((width, height), 1, disparity.tobytes(), dtype="f4", alignment=1)
        self._colors.filter = moderngl.LINEAR, moderngl.LINEAR
        self._disparity.filter = moderngl.NEAREST, moderngl.NEAREST
        for texture in (self._colors, self._disparity):
            texture.repeat_x = texture.repeat_y = False
        super().__init__(self._colors, self._disparity)

    def use(self, program: Program, colors_unit: int, disparity_unit: int) -> None:
        """Bind the textures and set the uniforms of a program with BEHIND."""
        self._colors.use(colors_unit)
        self._disparity.use(disparity_unit)
        program.set_uniforms(hidden=colors_unit, hidden_disparity=disparity_unit, hidden_size_px=self._size)
