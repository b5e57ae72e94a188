"""The images that passes draw into on the way to the screen: sums of linear light as RGBA32F.

Row 0 comes first in all but the last, which is the screen's.
"""

from __future__ import annotations

from typing import Any

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.scenes import ScreenSize


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

    def multiply(self) -> None:
        """Multiply what is here by what is drawn from now on."""
        self.framebuffer.use()
        self._ctx.enable(moderngl.BLEND)
        self._ctx.blend_func = moderngl.ZERO, moderngl.SRC_COLOR

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


class LayerTargets:
    """Light kept apart by its defocus, see shaders/include/layers.glsl.

    sums: sharp, in front, behind. across, smooth: foreground and behind, smoothed, at half
    the size.
    """

    def __init__(self, ctx: moderngl.Context, sharp: moderngl.Texture) -> None:
        """sharp: where its layer is summed up, not released with the others."""
        size_px = ScreenSize(*sharp.size)
        self._added = [_light(ctx, size_px) for _ in range(2)]
        self.sums = RenderTarget(ctx, [sharp, *self._added])
        half = ScreenSize((size_px.width + 1) // 2, (size_px.height + 1) // 2)
        self.across = RenderTarget(ctx, [_light(ctx, half) for _ in range(2)])
        self.smooth = RenderTarget(ctx, [_light(ctx, half) for _ in range(2)])

    def release(self) -> None:
        """Free framebuffers and textures."""
        self.sums.framebuffer.release()
        for texture in self._added:
            texture.release()
        self.across.release()
        self.smooth.release()


class RenderTargets:
    """The targets of one picture size.

    light: all of it, or what is sharp. tiles, wide_tiles: blur widths, and passes. spans: where searches begin and end.
    image: the finished picture, RGBA8, rows bottom-up.
    """

    def __init__(self, ctx: moderngl.Context, size_px: ScreenSize, tile_px: int) -> None:
        self._ctx = ctx
        width, height = self.size_px = size_px
        tiles = ScreenSize(-(-width // tile_px), -(-height // tile_px))
        self.image = RenderTarget(ctx, [ctx.texture(size_px, 4)])
        self.light = RenderTarget(ctx, [_light(ctx, size_px)])
        self.tiles = RenderTarget(ctx, [_light(ctx, tiles)])
        self.wide_tiles = RenderTarget(ctx, [_light(ctx, tiles)])
        self.spans = RenderTarget(ctx, [_light(ctx, tiles) for _ in range(2)])
        self._layers: LayerTargets | None = None

    @property
    def layers(self) -> LayerTargets:
        """Allocated when first asked for: most pictures that are sharp all over need none."""
        if self._layers is None:
            self._layers = LayerTargets(self._ctx, self.light.textures[0])
        return self._layers

    def sum_of(self, keeps_layers: bool) -> RenderTarget:
        """Where light is summed up, apart by its defocus or not."""
        return self.layers.sums if keeps_layers else self.light

    def release(self) -> None:
        """Free framebuffers and textures."""
        unbind(self._ctx)
        if self._layers is not None:
            self._layers.release()
        for target in (self.image, self.light, self.tiles, self.wide_tiles, self.spans):
            target.release()


def unbind(ctx: moderngl.Context) -> None:
    """Needed before a framebuffer is released: moderngl binds what was last used again, and that must still exist."""
    ctx.detect_framebuffer(0).use()


def _light(ctx: moderngl.Context, size_px: ScreenSize) -> moderngl.Texture:
    texture = ctx.texture(size_px, 4, dtype="f4")
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture
