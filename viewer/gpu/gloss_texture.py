"""Maps of a glossy surface on the graphics card, and GL objects that several holders share."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import moderngl

from iibr_core.gloss.settings import Gloss
from viewer.gpu.programs import Program

if TYPE_CHECKING:
    from iibr_core.gloss.shading import GlossMaps

UNIT = 8
"""Texture unit; the passes use smaller numbers."""


class Shared:
    """GL objects with several holders, each of which calls `release` once; the last call frees them."""

    def __init__(self, *objects: Any) -> None:
        self._objects, self._holders = objects, 1

    @property
    def is_shared(self) -> bool:
        """Whether there are several holders."""
        return self._holders > 1

    def hold(self) -> None:
        """Count a holder."""
        self._holders += 1

    def release(self) -> None:
        """Count a holder less."""
        self._holders -= 1
        if self._holders == 0:
            for gl_object in self._objects:
                gl_object.release()


class GlossTexture(Shared):
    """A glossy surface as a texture, see shaders/include/gloss.glsl. Light and roughness are uniforms."""

    def __init__(self, ctx: moderngl.Context, maps: GlossMaps) -> None:
        """maps: of the field's size."""
        height, width, channels = maps.packed.shape
        self._geometry, self._min_nearness = maps.geometry, maps.min_nearness
        self._texture = ctx.texture((width, height), channels, maps.packed.tobytes(), dtype="f4", alignment=1)
        self._texture.filter = moderngl.LINEAR, moderngl.LINEAR
        self._texture.repeat_x = self._texture.repeat_y = False
        super().__init__(self._texture)

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
