"""The images that passes draw into on the way to the screen. Linear light as RGBA16F; row 0 first but in the last."""

from __future__ import annotations

import moderngl


class Target:
    """Textures of one size that a pass draws into together."""

    def __init__(self, ctx: moderngl.Context, textures: list[moderngl.Texture]) -> None:
        self.textures = textures
        self.framebuffer = ctx.framebuffer(textures)

    def use(self) -> None:
        """Draw here from now on."""
        self.framebuffer.use()


class Targets:
    """The targets of one picture size.

    light: all light in one layer. light_layers: in focus, in front, behind, see shaders/include/layers.glsl.
    tiles, wide_tiles: blur widths. half_across, half_smooth: front and back layers, smoothed, at half size.
    image: the finished picture, RGBA8, rows bottom-up.
    """

    def __init__(self, ctx: moderngl.Context, size_px: tuple[int, int], tile_px: int) -> None:
        self._ctx = ctx
        width, height = self.size_px = size_px
        half = (width + 1) // 2, (height + 1) // 2
        tiles = -(-width // tile_px), -(-height // tile_px)
        self.image = Target(ctx, [ctx.texture(size_px, 4)])
        layers = [_light(ctx, size_px) for _ in range(3)]
        self.light = Target(ctx, layers[:1])
        self.light_layers = Target(ctx, layers)
        self.half_across = Target(ctx, [_light(ctx, half) for _ in range(2)])
        self.half_smooth = Target(ctx, [_light(ctx, half) for _ in range(2)])
        self.tiles = Target(ctx, [_light(ctx, tiles, 2)])
        self.wide_tiles = Target(ctx, [_light(ctx, tiles, 2)])

    def release(self) -> None:
        """Free framebuffers and textures."""
        self._ctx.detect_framebuffer(0).use()  # moderngl binds what was last used again, and that must still exist
        own = [self.image, self.light_layers, self.half_across, self.half_smooth, self.tiles, self.wide_tiles]
        for target in (*own, self.light):
            target.framebuffer.release()
        for target in own:  # the texture of `light` is the first of `light_layers`
            for texture in target.textures:
                texture.release()


def _light(ctx: moderngl.Context, size_px: tuple[int, int], components: int = 4) -> moderngl.Texture:
    texture = ctx.texture(size_px, components, dtype="f2")
    texture.filter = (moderngl.LINEAR, moderngl.LINEAR)
    texture.repeat_x = texture.repeat_y = False
    return texture
