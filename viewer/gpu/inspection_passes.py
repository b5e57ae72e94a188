"""Images for inspecting a light field: EPIs, the sheet of views, overlays, compared pictures. Rows top-down."""

from __future__ import annotations

import math
from typing import Any, NamedTuple

import moderngl
import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import Optics
from iibr_core.gloss.settings import Gloss
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB
from viewer.gpu.light_field_texture import LightFieldTexture
from viewer.gpu.programs import Program, ProgramCache
from viewer.gpu.refocus.picture_lens import dolly_of
from viewer.gpu.render_targets import RenderTarget, sized

MAX_VIEWS = 128
"""Largest number of views of a row or column of the grid, as in shaders/epi.frag."""
MAX_TAPS = 3
"""Largest number of places, in each direction, that a pixel of a view drawn smaller averages."""


class OverlayStyle(NamedTuple):
    """Ten colours (sRGB bytes) for values from the first of map_ends to the last. is_mask: drawn only where 1."""

    color_map: tuple[tuple[float, float, float], ...]
    map_ends: tuple[float, float]
    opacity: float = 1.0
    is_mask: bool = False


class Line(NamedTuple):
    """The line of an EPI.

    view: index of the row of views (across) or column (upright). at: texture coordinate in them. span: start and
    length of the shown part, as shares of the line.
    """

    view: int
    at: float
    is_upright: bool = False
    span: tuple[float, float] = (0.0, 1.0)


class InspectionPasses:
    """Draws images; each method returns the GL name of a texture, which its next call may change."""

    def __init__(self, ctx: moderngl.Context, programs: ProgramCache) -> None:
        self._ctx, self._programs = ctx, programs
        self._images: dict[str, RenderTarget] = {}
        self._textures: dict[str, moderngl.Texture] = {}

    def release(self) -> None:
        """Free every GL object."""
        for image in self._images.values():
            image.release()
        for texture in self._textures.values():
            texture.release()
        self._images.clear()
        self._textures.clear()

    def draw_epi(
        self, field: LightFieldTexture, line: Line, size_px: ScreenSize, exposure: float, gloss: Gloss | None = None
    ) -> int:
        """Draw one line of the picture in every view of a row or column. size_px: (width, height)."""
        switches = {"UPRIGHT": line.is_upright, "GLOSS": gloss is not None and field.gloss is not None}
        program = self._programs.get("epi.frag", switches | _conversion(field))
        views = np.s_[:MAX_VIEWS, line.view] if line.is_upright else np.s_[line.view, :MAX_VIEWS]
        layers = np.where(field.present, field.layers, -1)[views].tolist()
        _use_colors(program, field, exposure)
        padded = layers + [-1] * (MAX_VIEWS - len(layers))
        program.set_uniforms(layers=padded, view_count=len(layers), line=line.at, span=line.span)
        if gloss is not None and field.gloss is not None:
            first = field.grid.offset(0, line.view) if line.is_upright else field.grid.offset(line.view, 0)
            far, near = field.range_px
            field.gloss.use(program, gloss, (first.s, first.t))
            program.set_uniforms(nearest=near, farthest=far, **_sizes_of(field))
        texture = self._use_image("upright" if line.is_upright else "across", size_px)
        program.draw()
        return texture

    def start_sheet(self, size_px: ScreenSize) -> int:
        """Clear the sheet, which `draw_on_sheet` fills."""
        texture = self._use_image("sheet", size_px)
        self._ctx.clear(0.0, 0.0, 0.0, 1.0)
        return texture

    def draw_on_sheet(
        self, field: LightFieldTexture, row: int, column: int, cell: tuple[int, int, int, int], exposure: float
    ) -> None:
        """Draw one view, or a sign that it is missing, into its cell of the sheet: x, y from the top, width, height."""
        framebuffer = self._images["sheet"].framebuffer
        framebuffer.use()
        framebuffer.viewport = cell
        self._draw_stored(field, (row, column), ScreenSize(*cell[2:]), exposure)
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
        """Draw one stored view, or make it smaller, as the image `name`."""
        size_px = size_px or ScreenSize(field.width, field.height)
        texture = self._use_image(name, size_px)
        self._draw_stored(field, (row, column), size_px, exposure)
        return texture

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
        """Draw a number at every pixel of the picture, in colours: the disparity of a stored view, or `values` (H, W),
        255 = 1, that belong to it.

        part: part of the picture, as a share of it. The view needs a disparity.
        """
        program = self._programs.get("overlay.frag", {"VALUES": values is not None, "MASK": style.is_mask})
        at = field.grid.offset(*view)
        far, near = field.range_px
        field.disparities.use(1)
        program.set_uniforms(disparities=1, nearest=near, farthest=far, **_sizes_of(field))
        program.set_uniforms(
            dolly=dolly_of(optics, field),
            to_view=(at.s - optics.eye.s, at.t - optics.eye.t),
            layer=float(field.layers[view]),
            color_map=[tuple(value / 255 for value in color) for color in style.color_map],
            map_ends=style.map_ends,
            opacity=style.opacity,
            part=part,
        )
        if values is not None:
            self._texture("values", np.ascontiguousarray(values)[..., None]).use(2)
            program.set_uniforms(values=2)
        texture = self._use_image("overlay", size_px)
        program.draw()
        return texture

    def show(self, name: str, pixels: NDArray[Any]) -> int:
        """Upload an image (H, W, 3) under this name."""
        return self._texture(name, pixels).glo

    def read(self, name: str) -> NDArray[np.uint8]:
        """Return an image drawn here (H, W, 4)."""
        framebuffer = self._images[name].framebuffer
        width, height = framebuffer.size
        return np.frombuffer(framebuffer.read(components=4, alignment=1), np.uint8).reshape(height, width, 4)

    def _draw_stored(
        self, field: LightFieldTexture, view: tuple[int, int], size_px: ScreenSize, exposure: float
    ) -> None:
        program = self._programs.get("stored_view.frag", _conversion(field))
        self._ctx.disable(moderngl.BLEND)
        _use_colors(program, field, exposure)
        taps = min(math.ceil(max(field.width / size_px[0], field.height / size_px[1])), MAX_TAPS)
        layer = float(field.layers[view]) if field.present[view] else -1.0
        program.set_uniforms(layer=layer, taps=max(taps, 1), pixel=(1 / size_px[0], 1 / size_px[1]))
        program.draw()

    def _use_image(self, name: str, size_px: ScreenSize) -> int:
        """Draw into this image from now on; return its texture. Another size replaces it."""
        image = self._images[name] = sized(self._ctx, self._images.get(name), size_px)
        image.framebuffer.use()
        self._ctx.disable(moderngl.DEPTH_TEST | moderngl.CULL_FACE | moderngl.BLEND)
        return image.texture.glo

    def _texture(self, name: str, pixels: NDArray[Any]) -> moderngl.Texture:
        """Return a texture with these (H, W, C) pixels."""
        height, width, components = pixels.shape
        texture = self._textures.get(name)
        if texture is None or texture.size != (width, height):
            if texture is not None:
                texture.release()
            texture = self._textures[name] = self._ctx.texture((width, height), components, alignment=1)
            texture.repeat_x = texture.repeat_y = False
        texture.write(pixels.tobytes(), alignment=1)
        return texture


def _conversion(field: LightFieldTexture) -> dict[str, bool]:
    """Return the switch for the conversion to the screen's sRGB."""
    return {"OTHER_PRIMARIES": field.color_space != SRGB}


def _sizes_of(field: LightFieldTexture) -> dict[str, tuple[float, float]]:
    return {"view_size_px": (field.width, field.height), "view_step": (1.0, field.row_step)}


def _use_colors(program: Program, field: LightFieldTexture, exposure: float) -> None:
    field.colors.use(0)
    program.set_uniforms(colors=0, exposure=exposure)
    program.set_primaries(SRGB, field.color_space)
