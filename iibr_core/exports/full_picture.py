"""A picture of a photo at its own size or smaller, drawn tile by tile from views of the photo on disk.

The views of a tile lie around the eye, only as many as its lens needs; the renderer of the window draws it from them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import CENTRE, Optics
from iibr_core.color import bytes_from_encoded, primaries_matrix, srgb_from_linear, stored_from_encoded
from iibr_core.exports.render_settings import LensTile, RenderSettings
from iibr_core.exports.source import Draw
from iibr_core.method.memory import require_memory
from iibr_core.method.plan import ScenePlan
from iibr_core.runtime.tiling import in_bands
from iibr_core.runtime.work import raise_if_stopped, report_progress
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.scene import LoadedPhoto, Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import (
    ColorSpace,
    FloatImage,
    GridShape,
    ImageSize,
    InputError,
    ViewOffset,
    ViewUpdate,
    image_size,
)

if TYPE_CHECKING:
    # The renderer is imported by the thread that draws, so that the window opens first.
    from iibr_core.beyond.full_size import LargePhoto, Part
    from iibr_core.method.view import Renderer

MAX_PIXELS = 100_000_000
"""Largest number of pixels of the photo; a larger photo is read at this size."""
OWN_SIZE_BYTES = 60
"""Bytes of a pixel of a picture at the photo's own size, while it is drawn."""
TILE_PX = 768
"""Side of a tile in pixels of the photo, without the margin of its views."""
MARGIN_PX = 4
"""Margin of a tile's views beside parallax, in pixels, for the kernels."""
PARALLAX_PX = (1.5, 16.0)
"""Parallax within a tile from the eye to the border of the aperture, in pixels of the photo, above which the tile needs
views at the border, and above which it needs views half-way, too.
"""
DRAWING = "drawing at the photo's own size"


@dataclass(frozen=True, eq=False)
class FullPicture:
    """A picture to be drawn. size: of the result. part: the drawn part, as a share of the whole picture."""

    scene: Scene
    plan: ScenePlan
    loaded: LoadedPhoto
    optics: Optics
    size: ScreenSize
    part: Rect = WHOLE

    def make(
        self,
        draw: Draw,
        photo: LargePhoto | None = None,
        keep: Callable[[LargePhoto], None] = lambda photo: None,
    ) -> FloatImage:
        """Return the picture, linear light (height, width, 3).

        draw: draws a tile. photo: the photo as it was kept for an earlier picture. keep: is called with the photo once
        it is read, and again once its hidden surfaces are inpainted. Raises InputError if the file is missing or has
        changed.
        """
        from iibr_core.method.view import Renderer
        from iibr_core.scenes.large_photo import complete_fills, load_large

        source = self.scene.source
        report_progress(0, 0, "reading the photo at its own size")
        if photo is None:
            photo = load_large(source, self.loaded, self.plan, MAX_PIXELS)
            keep(photo)
        if _shows_hidden(self.optics) and photo.fills is None:
            photo = replace(photo, fills=complete_fills(source, self.loaded, self.plan))
            keep(photo)
        return self._draw_tiles(photo, Renderer(), draw)

    def _draw_tiles(
        self,
        photo: LargePhoto,
        renderer: Renderer,
        draw: Draw,
    ) -> FloatImage:
        from iibr_core.beyond.full_size import Part, tiles_of, whole
        from iibr_core.beyond.resized_light import mean_of_areas

        height, width = photo.size
        top, left = self.part.y * height, self.part.x * width
        down, across = self.part.height * height, self.part.width * width
        pixels = Part(math.floor(top), math.ceil(top + down), math.floor(left), math.ceil(left + across))
        pixels = pixels.grown(0, whole(photo.size))
        light = np.empty((*pixels.size, 3), np.float32)
        tiles = tiles_of(pixels, TILE_PX)
        for done, tile in enumerate(tiles):
            report_progress(done, len(tiles), DRAWING)
            light[tile.inside(pixels).slices] = draw(self._tile_settings(photo, tile, renderer))
            raise_if_stopped()
        report_progress(len(tiles), len(tiles), DRAWING)
        size = ImageSize(self.size.height, self.size.width)
        return mean_of_areas(light, size, (top - pixels.top, left - pixels.left, down, across))

    def _tile_settings(self, photo: LargePhoto, tile: Part, renderer: Renderer) -> RenderSettings:
        """Return the settings of a tile, with the views around the eye that its lens needs."""
        from iibr_core.beyond.full_size import views_of_tile, whole

        optics, eye = self.optics.with_focus_scaled(photo.size.width / self.scene.width), self.optics.eye
        diameter = min(max(optics.aperture_diameter, 0.0), float(max(self.scene.grid)))
        rings, margin_px = _rings_of(photo, tile, optics, diameter / 2)
        step = diameter / 2 / rings if rings else max(diameter / 2, 1.0)
        around = tile.grown(min(margin_px, max(photo.size)), whole(photo.size))
        grid = GridShape(2 * rings + 1, 2 * rings + 1)
        places = [(row, column) for row in range(grid.rows) for column in range(grid.columns)]
        offsets = [ViewOffset(eye.t + step * (row - rings), eye.s + step * (column - rings)) for row, column in places]
        rendered = views_of_tile(photo, around, offsets, renderer)
        views = tuple(
            ViewUpdate(*place, stored_from_encoded(view.colors, True), view.disparity * np.float32(step))
            for place, view in zip(places, rendered)
        )
        gain = self.optics.highlight_gain(self.optics.aperture_diameter, self.scene.is_hdr)
        return RenderSettings(
            replace(optics.with_focus_scaled(step), eye=CENTRE, aperture_diameter=diameter / step),
            ScreenSize(tile.size.width, tile.size.height),
            _share_of(tile, photo.size),
            is_linear=True,
            color_space=self.scene.color_space,
            tile=LensTile(_share_of(around, photo.size), grid, views, gain),
        )


def _rings_of(photo: LargePhoto, tile: Part, optics: Optics, radius: float) -> tuple[int, int]:
    """Return the rings of views around the eye for a lens of this radius (view steps), and their margin in pixels."""
    from iibr_core.beyond.full_size import whole

    farthest = photo.greatest_disparity
    steepest = abs(optics.focus_disparity) + sum(map(abs, optics.focus_tilt)) + max(optics.focus_range, 0.0)
    margin_px = MARGIN_PX + math.ceil(min(radius * (steepest + 1.5 * farthest), max(photo.size)))
    moved_px = math.ceil(min(max(map(abs, optics.eye)) * farthest, max(photo.size)))
    seen = photo.disparity[tile.grown(margin_px + moved_px, whole(photo.size)).slices]
    parallax_px = radius * float(seen.max() - seen.min())
    return sum(parallax_px > limit for limit in PARALLAX_PX), margin_px


def _shows_hidden(optics: Optics) -> bool:
    return optics.eye != CENTRE or optics.aperture_diameter > 0


def _share_of(part: Part, size: ImageSize) -> Rect:
    (height, width), (rows, columns) = size, part.size
    return Rect(part.left / width, part.top / height, columns / width, rows / height)


def encode_light(light: FloatImage, is_linear: bool, target: ColorSpace, source: ColorSpace) -> NDArray[Any]:
    """Convert linear light (H, W, 3) to another colour space; return light, or bytes encoded by sRGB's curve."""
    encoded = np.empty(light.shape, np.float32 if is_linear else np.uint8)
    matrix = primaries_matrix(target, source)

    def band(first: int, last: int) -> None:
        rows = light[first:last]
        converted = rows if target == source else rows @ matrix.T
        encoded[first:last] = converted if is_linear else bytes_from_encoded(srgb_from_linear(converted))

    in_bands(band, image_size(light))
    return encoded


def is_full(scene: Scene, optics: Optics, size: ScreenSize) -> bool:
    """Return whether a picture of this size is drawn from the photo at its own size.

    It is if it is larger than the scene's views, fits into memory, and has neither a dolly nor gloss.
    """
    if optics.dolly != 0 or optics.gloss is not None or scene.plan is None or scene.own_size is None:
        return False
    if min(math.prod(size), math.prod(scene.own_size)) <= math.prod(scene.size):
        return False
    try:
        require_full(scene, optics)
    except InputError:
        return False
    return True


def require_full(scene: Scene, optics: Optics) -> None:
    """Raise InputError if a picture at the photo's own size does not fit into memory."""
    from iibr_core.formats.images.photo import size_within

    if scene.plan is None or scene.own_size is None:
        return
    own_width, own_height = scene.own_size
    read = size_within(ImageSize(own_height, own_width), MAX_PIXELS)
    require_memory(math.prod(read) * OWN_SIZE_BYTES, f"a picture at the photo's own size, {read},")
