"""What a gloss means for a photo, on the graphics card; what a user drags, light and roughness, are uniforms."""

from __future__ import annotations

from typing import TYPE_CHECKING

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering.gloss.gloss_settings import Gloss
from viewer.gpu.programs import Program
from viewer.gpu.shared import Holders

if TYPE_CHECKING:
    from iibr_core.rendering.gloss.shading import GlossMaps

FIRST_UNIT = 8
"""Units below belong to the passes."""


class GlossTextures:
    """The maps of one gloss as textures; see shaders/include/gloss.glsl."""

    def __init__(self, ctx: moderngl.Context, maps: GlossMaps) -> None:
        """maps: of the field's size."""
        self._maps = maps
        surface = np.dstack([maps.normals[..., :2], maps.mask, maps.disparity])
        self._textures = {"surface": _texture(ctx, surface, "f4")}
        if maps.reflected is not None:
            self._textures["reflected"] = _texture(ctx, maps.reflected, "f2")
        if maps.reflected_disparity is not None:
            virtual = maps.reflected_disparity.reshape(*maps.disparity.shape, 4)
            self._textures["virtual"] = _texture(ctx, virtual, "f4")
        if maps.environment is not None:
            self._textures["surroundings"] = _texture(ctx, maps.environment, "f2")
            self._textures["surroundings"].repeat_x = True
        self._holders = Holders(self._free)

    def use(self, program: Program, wanted: Gloss, eye: tuple[float, float]) -> None:
        """Bind the textures and set the uniforms of a program with GLOSS. eye: (s, t) in view steps."""
        # A light that the photo shows is as strong as it is found there.
        gloss = self._maps.gloss if self._maps.gloss.photo_shines else wanted
        units = {name: unit for unit, name in enumerate(self._textures, start=FIRST_UNIT)}
        for name, texture in self._textures.items():
            texture.use(units[name])
        for name in ("reflected", "virtual", "surroundings"):
            program.set_uniform(f"gloss_has_{name}", name in units)
            program.set_uniform(f"gloss_{name}", units.get(name, FIRST_UNIT))
        width2, disc = gloss.lobe_widths
        geometry = self._maps.geometry
        program.set_uniforms(
            gloss_surface=FIRST_UNIT,
            eye=eye,
            gloss_focal=geometry.focal_px,
            gloss_infinity=geometry.infinity,
            gloss_least_nearness=float(geometry.nearness(self._maps.disparity).min()),
            gloss_light=gloss.light.unit_direction,
            gloss_radiance=gloss.light.radiance,
            gloss_lobe=(width2, disc, gloss.reflectance),
        )

    def share(self) -> GlossTextures:
        """The same, for one more holder, who is to release it too."""
        self._holders.add()
        return self

    def release(self) -> None:
        """Free the textures, unless somebody else holds them."""
        self._holders.release()

    def _free(self) -> None:
        for texture in self._textures.values():
            texture.release()


def _texture(ctx: moderngl.Context, values: NDArray[np.float32], dtype: str) -> moderngl.Texture:
    height, width, channels = values.shape
    data = np.ascontiguousarray(values, np.float16 if dtype == "f2" else np.float32)
    texture = ctx.texture((width, height), channels, data.tobytes(), dtype=dtype, alignment=1)
    texture.filter = moderngl.LINEAR, moderngl.LINEAR
    texture.repeat_x = texture.repeat_y = False
    return texture
