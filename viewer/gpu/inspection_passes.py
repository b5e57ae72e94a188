"""Images for looking into a light field: EPIs, the sheet of views, overlays, compared images. Rows top-down."""

from __future__ import annotations

import math
from typing import NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import Optics
from iibr_core.color import bytes_from_encoded, convert, encoded_from_stored, srgb_from_linear
from iibr_core.gloss.settings import Gloss
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.programs import Program, ProgramCache, set_primaries
from viewer.gpu.render_targets import RenderTarget, unbind
from viewer.model.layout import PixelRect

MAX_VIEWS = 128
"""As in shaders/epi.frag: of one row or column of the grid."""

MAX_TAPS = 3


class OverlayStyle(NamedTuple):
    """Ten colours (sRGB bytes) for values from the first of map_ends to the last. is_mask: drawn only where 1."""

    color_map: tuple[tuple[float, float, float], ...]
    map_ends: tuple[float, float]
    opacity: float = 1.0
    is_mask: bool = False


class Line(NamedTuple):
    """What an EPI shows.

    view: index of the row of views (across) or column (upright); at: texture coordinate in them. span: what of the
    line is shown: where it begins, and how much, as shares of it.
    """

    view: int
    at: float
    is_upright: bool = False
    span: tuple[float, float] = (0.0, 1.0)


class InspectionPasses:
    """Draws images of its own; each method returns the GL name of a texture, which the next call of it may change."""

    def __init__(self, ctx: moderngl.Context, programs: ProgramCache) -> None:
        self._ctx = ctx
        self._programs = programs
        self._images: dict[str, RenderTarget] = {}
        self._textures: dict[str, moderngl.Texture] = {}

    def release(self) -> None:
        """Free every GL object."""
        for name in list(self._images):
            self._drop(name)
        for texture in self._textures.values():
            texture.release()
        self._textures.clear()

    def draw_epi(
        self, field: LightFieldTexture, line: Line, size_px: ScreenSize, exposure: float, gloss: Gloss | None = None
    ) -> int:
        """One line of the picture in every view of a row or column. size_px: (width, height). gloss: seen in it."""
        name, switches = ("upright", ("UPRIGHT",)) if line.is_upright else ("across", ())
        is_glossy = gloss is not None and field.gloss is not None
        switches += (*_converting(field), *(("GLOSS",) if is_glossy else ()))
        program, quad = self._programs.get("epi.frag", switches)
        places = [(row, line.view) for row in range(field.grid.rows)]
        if not line.is_upright:
            places = [(line.view, column) for column in range(field.grid.columns)]
        layers = [_layer(field, *place) for place in places[:MAX_VIEWS]]
        self._use_colors(program, field, exposure)
        program.set_uniforms(layers=layers + [-1] * (MAX_VIEWS - len(layers)), view_count=len(layers), line=line.at)
        program.set_uniforms(span=line.span)
        if gloss is not None and field.gloss is not None:
            first, (far, near) = field.grid.offset(*places[0]), field.range_px
            field.gloss.use(program, gloss, (first.s, first.t))
            program.set_uniforms(view_size_px=(field.width, field.height), nearest=near, farthest=far)
        texture = self._use_image(name, size_px)
        quad.render(moderngl.TRIANGLES, vertices=3)
        return texture

    def start_sheet(self, size_px: ScreenSize) -> int:
        """An empty sheet, to be filled by `draw_on_sheet`."""
        texture = self._use_image("sheet", size_px)
        self._ctx.clear(0.0, 0.0, 0.0, 1.0)
        return texture

    def draw_on_sheet(self, field: LightFieldTexture, row: int, column: int, cell: PixelRect, exposure: float) -> None:
        """Draw one view, or that it is not there, into its cell of the sheet; y counts from the top."""
        framebuffer = self._images["sheet"].framebuffer
        framebuffer.use()
        framebuffer.viewport = cell
        self._draw_stored(field, _layer(field, row, column), cell.size, exposure)
        framebuffer.viewport = (0, 0, *framebuffer.size)

    def draw_view(
        self,
        field: LightFieldTexture,
        row: int,
        column: int,
        name: str,
        exposure: float,
        size_px: ScreenSize | None = None,
    ) -> int:
        """One stored view as it is, or smaller, as the image `name`."""
        size_px = size_px or ScreenSize(field.width, field.height)
        texture = self._use_image(name, size_px)
        self._draw_stored(field, _layer(field, row, column), size_px, exposure)
        return texture

    def read_view(self, field: LightFieldTexture, row: int, column: int) -> NDArray[np.uint8] | None:
        """One stored view (H, W, 3) as sRGB bytes, white where it exceeds that; None where it is not there."""
        layer = _layer(field, row, column)
        if layer < 0:
            return None
        texture = self._ctx.texture((field.width, field.height), 3, dtype="f2" if field.hdr else "f1")
        target = RenderTarget(self._ctx, [texture])
        target.use()
        self._draw_stored(field, layer, ScreenSize(*texture.size), 1.0, as_stored=True)
        read = texture.read(alignment=1)
        self._release(target)
        root = np.frombuffer(read, np.float16) if field.hdr else np.frombuffer(read, np.uint8)
        encoded = _encoded_from_root(root).reshape(field.height, field.width, 3)
        if field.color_space == SRGB:
            return encoded
        return bytes_from_encoded(convert(encoded_from_stored(encoded), SRGB, field.color_space))

    def draw_overlay(
        self,
        field: LightFieldTexture,
        optics: Optics,
        view: tuple[int, int],
        size_px: ScreenSize,
        style: OverlayStyle,
        values: NDArray[np.uint8] | None = None,
        part: Rect = WHOLE,
    ) -> int:
        """What a stored view knows at every pixel of the picture: its disparity, or `values` (H, W), 255 = 1.

        part: of the picture, as a share of it. The view needs a disparity.
        """
        switches = (*(("VALUES",) if values is not None else ()), *(("MASK",) if style.is_mask else ()))
        program, quad = self._programs.get("overlay.frag", switches)
        at = field.grid.offset(*view)
        to_view = at.s - optics.eye.s, at.t - optics.eye.t
        far, near = field.range_px
        dolly = -2.0 * optics.dolly, -2.0 * optics.dolly * field.height / field.width
        field.disparities.use(1)
        program.set_uniforms(disparities=1, view_size_px=(field.width, field.height), nearest=near, farthest=far)
        program.set_uniforms(dolly=dolly, to_view=to_view, layer=float(field.layers[view]))
        colors = [tuple(value / 255 for value in color) for color in style.color_map]
        program.set_uniforms(color_map=colors, map_ends=style.map_ends, opacity=style.opacity)
        program.set_uniforms(part=part)
        if values is not None:
            self._texture("values", np.ascontiguousarray(values)[..., None]).use(2)
            program.set_uniforms(values=2)
        texture = self._use_image("overlay", size_px)
        quad.render(moderngl.TRIANGLES, vertices=3)
        return texture

    def show(self, name: str, pixels: NDArray[np.uint8]) -> int:
        """Upload an image (H, W, 3) under this name."""
        return self._texture(name, pixels).glo

    def read(self, name: str) -> NDArray[np.uint8]:
        """An image drawn here (H, W, 4)."""
        framebuffer = self._images[name].framebuffer
        width, height = framebuffer.size
        return np.frombuffer(framebuffer.read(components=4, alignment=1), np.uint8).reshape(height, width, 4)

    def _draw_stored(
        self, field: LightFieldTexture, layer: int, size_px: ScreenSize, exposure: float, as_stored: bool = False
    ) -> None:
        program, quad = self._programs.get("stored_view.frag", ("AS_STORED",) if as_stored else _converting(field))
        self._ctx.disable(moderngl.BLEND)
        self._use_colors(program, field, exposure)
        taps = min(math.ceil(max(field.width / size_px[0], field.height / size_px[1])), MAX_TAPS)
        program.set_uniforms(layer=float(layer), taps=max(taps, 1), pixel=(1 / size_px[0], 1 / size_px[1]))
        if as_stored:
            field.colors.filter = (moderngl.NEAREST, moderngl.NEAREST)
        quad.render(moderngl.TRIANGLES, vertices=3)
        if as_stored:
            field.colors.filter = (moderngl.LINEAR, moderngl.LINEAR)

    def _use_colors(self, program: Program, field: LightFieldTexture, exposure: float) -> None:
        field.colors.use(0)
        program.set_uniforms(colors=0, exposure=exposure)
        set_primaries(program, SRGB, field.color_space)

    def _use_image(self, name: str, size_px: ScreenSize) -> int:
        """Draw into this image from now on; a new size makes it again."""
        if name not in self._images or self._images[name].framebuffer.size != size_px:
            self._drop(name)
            self._images[name] = RenderTarget(self._ctx, [self._ctx.texture(size_px, 4)])
        target = self._images[name]
        target.use()
        self._ctx.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
        return target.textures[0].glo

    def _texture(self, name: str, pixels: NDArray[np.uint8] | NDArray[np.float32]) -> moderngl.Texture:
        """A texture with these (H, W, C) pixels."""
        height, width, components = pixels.shape
        texture = self._textures.get(name)
        if texture is None or texture.size != (width, height):
            if texture is not None:
                texture.release()
            kind = "f4" if pixels.dtype == np.float32 else "f1"
            texture = self._ctx.texture((width, height), components, dtype=kind, alignment=1)
            texture.repeat_x = texture.repeat_y = False
            self._textures[name] = texture
        texture.write(pixels.tobytes(), alignment=1)
        return texture

    def _drop(self, name: str) -> None:
        if name in self._images:
            self._release(self._images.pop(name))

    def _release(self, target: RenderTarget) -> None:
        unbind(self._ctx)
        target.release()


def _layer(field: LightFieldTexture, row: int, column: int) -> int:
    return int(field.layers[row, column]) if field.present[row, column] else -1


def _converting(field: LightFieldTexture) -> tuple[str, ...]:
    """Switches for what goes to the screen, which is sRGB."""
    return () if field.color_space == SRGB else ("OTHER_PRIMARIES",)


def _encoded_from_root(root: NDArray[np.uint8] | NDArray[np.float16]) -> NDArray[np.uint8]:
    """Bytes (sRGB) of roots of linear light, as bytes or as numbers."""
    values = np.arange(256) / 255 if root.dtype == np.uint8 else root.astype(np.float32)
    encoded = np.rint(np.clip(srgb_from_linear(values**2), 0, 1) * 255).astype(np.uint8)
    return encoded[root] if root.dtype == np.uint8 else encoded
