"""Maps of a glossy surface on the graphics card. Light, roughness and reflectance are uniforms."""

from __future__ import annotations

from typing import TYPE_CHECKING

import moderngl

from iibr_core.gloss.settings import Gloss
from viewer.gpu.programs import Program
from viewer.gpu.shared import Holders

if TYPE_CHECKING:
    from iibr_core.gloss.shading import GlossMaps

UNIT = 8
"""Texture unit; the passes use smaller numbers."""


class GlossTexture:
    """A glossy surface as a texture; see shaders/include/gloss.glsl."""

    def __init__(self, ctx: moderngl.Context, maps: GlossMaps) -> None:
        """maps: of the field's size."""
        height, width, channels = maps.packed.shape
        self._geometry, self._min_nearness = maps.geometry, maps.min_nearness
        self._texture = ctx.texture((width, height), channels, maps.packed.tobytes(), dtype="f4", alignment=1)
        self._texture.filter = moderngl.LINEAR, moderngl.LINEAR
        self._texture.repeat_x = self._texture.repeat_y = False
        self._holders = Holders(self._texture.release)

    def use(self, program: Program, gloss: Gloss, eye: tuple[float, float]) -> None:
        """Bind the texture and set the uniforms of a program with GLOSS. eye: (s, t) in view steps."""
        self._texture.use(UNIT)
        program.set_uniforms(
            gloss_surface=UNIT,
            eye=eye,
            gloss_focal=self._geometry.focal_px,
            gloss_infinity=self._geometry.infinity,
            gloss_min_nearness=self._min_nearness,
            gloss_light=gloss.light.unit_direction,
            gloss_radiance=gloss.light.radiance,
            gloss_lobe=gloss.lobe,
        )

    def share(self) -> GlossTexture:
        """Return the same texture for another holder, who must release it too."""
        self._holders.add()
        return self

    def release(self) -> None:
        """Free the texture, unless another holder needs it."""
        self._holders.release()
