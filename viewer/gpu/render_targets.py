"""The images that passes draw into on the way to the screen: sums of linear light as RGBA32F.

Row 0 comes first in all but the last, which is the screen's.
"""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.scenes.screen_size import ScreenSize


class RenderTarget:
    """Textures of one size that a pass draws into together."""

    def __init__(self, ctx: moderngl.Context, textures: list[moderngl.Texture]) -> None:
        self.textures = textures
        self.framebuffer = ctx.framebuffer(textures)
        self._ctx = ctx

    def use(self) -> None:
        """Draw here from now on."""
        self.framebuffer.use()

    def add(self) -> None:
        """Add what is drawn from now on to what is here: the first light, too, for drivers compile a program again for
        passes that replace.
        """
        self.framebuffer.use()
        self._ctx.enable(moderngl.BLEND)
        self._ctx.blend_func = moderngl.ONE, moderngl.ONE

    def read(self, dtype: type[np.uint8] | type[np.float32]) -> NDArray[Any]:
        """What was drawn, (H, W, 3), bytes or floats, row 0 at the top."""
        width, height = self.framebuffer.size
        raw = self.framebuffer.read(components=3, alignment=1, dtype="f1" if dtype is np.uint8 else "f4")
        return np.frombuffer(raw, dtype).reshape(height, width, 3)[::-1].copy()

    def release(self) -> None:
        """Free framebuffer and textures."""
        self.framebuffer.release()
        for texture in self.textures:
            texture.release()


class RenderTargets:
    """The targets of one picture size.

    light: the sum of light, weighted by alpha. image: the finished picture, RGBA8, rows bottom-up.
    """

    def __init__(self, ctx: moderngl.Context, size_px: ScreenSize) -> None:
        self._ctx = ctx
        self.size_px = size_px
        self.image = RenderTarget(ctx, [ctx.texture(size_px, 4)])
        self.light = RenderTarget(ctx, [_light(ctx, size_px)])

    def release(self) -> None:
        """Free framebuffers and textures."""
        unbind(self._ctx)
        self.image.release()
        self.light.release()


def unbind(ctx: moderngl.Context) -> None:
    """Needed before a framebuffer is released: moderngl binds what was last used again, and that must still exist."""
    ctx.detect_framebuffer(0).use()


def _light(ctx: moderngl.Context, size_px: ScreenSize) -> moderngl.Texture:
    texture = ctx.texture(size_px, 4, dtype="f4")
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture
