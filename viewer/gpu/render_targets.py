"""The images that passes draw into on the way to the screen: sums of linear light as RGBA32F.

Row 0 comes first in all but the last, which is the screen's.
"""

from __future__ import annotations

import moderngl

from viewer.model.layout import ScreenSize


class RenderTarget:
    """Textures of one size that a pass draws into together."""

    def __init__(self, ctx: moderngl.Context, textures: list[moderngl.Texture]) -> None:
        self.textures = textures
        self.framebuffer = ctx.framebuffer(textures)
        self._ctx = ctx
        self._holds_sum = False

    def use(self) -> None:
        """Draw here from now on."""
        self.framebuffer.use()

    @property
    def holds_sum(self) -> bool:
        """Whether the next `add` keeps what is here."""
        return self._holds_sum

    def start_sum(self) -> None:
        """The next `add` replaces what is here: blending and clearing cost time."""
        self._holds_sum = False

    def add(self, keeps: bool | None = None) -> None:
        """Add what is drawn from now on to what is here. keeps: False replaces it, None as `holds_sum` says."""
        self.framebuffer.use()
        if self._holds_sum if keeps is None else keeps:
            self._ctx.enable(moderngl.BLEND)
            self._ctx.blend_func = moderngl.ONE, moderngl.ONE
        else:
            self._ctx.disable(moderngl.BLEND)
        self._holds_sum = True

    def release(self) -> None:
        """Free framebuffer and textures."""
        self.framebuffer.release()
        for texture in self.textures:
            texture.release()


class RenderTargets:
    """The targets of one picture size.

    light: all of it, or what is sharp. blurred: in front, behind, and all weights, at half size, see
    shaders/include/layers.glsl. half_across, half_smooth: front and behind, smoothed. tiles, wide_tiles: blur widths.
    spans: where searches begin and end. image: the finished picture, RGBA8, rows bottom-up.
    """

    def __init__(self, ctx: moderngl.Context, size_px: ScreenSize, tile_px: int) -> None:
        self._ctx = ctx
        width, height = self.size_px = size_px
        half = ScreenSize((width + 1) // 2, (height + 1) // 2)
        tiles = ScreenSize(-(-width // tile_px), -(-height // tile_px))
        self.image = RenderTarget(ctx, [ctx.texture(size_px, 4)])
        self.light = RenderTarget(ctx, [_light(ctx, size_px)])
        self.blurred = RenderTarget(ctx, [_light(ctx, half), _light(ctx, half), _light(ctx, half, 2)])
        self.half_across = RenderTarget(ctx, [_light(ctx, half) for _ in range(2)])
        self.half_smooth = RenderTarget(ctx, [_light(ctx, half) for _ in range(2)])
        self.tiles = RenderTarget(ctx, [_light(ctx, tiles)])
        self.wide_tiles = RenderTarget(ctx, [_light(ctx, tiles)])
        self.spans = RenderTarget(ctx, [_light(ctx, tiles) for _ in range(2)])

    def of_layer(self, layer: str) -> RenderTarget:
        """Where a layer is summed up: "BLURRED", or "SHARP" or "" for all light."""
        return self.blurred if layer == "BLURRED" else self.light

    def release(self) -> None:
        """Free framebuffers and textures."""
        unbind(self._ctx)
        for target in (self.image, self.light, self.blurred, self.half_across, self.half_smooth, self.tiles):
            target.release()
        for target in (self.wide_tiles, self.spans):
            target.release()


def unbind(ctx: moderngl.Context) -> None:
    """Needed before a framebuffer is released: moderngl binds what was last used again, and that must still exist."""
    ctx.detect_framebuffer(0).use()


def _light(ctx: moderngl.Context, size_px: ScreenSize, components: int = 4) -> moderngl.Texture:
    texture = ctx.texture(size_px, components, dtype="f4")
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture
