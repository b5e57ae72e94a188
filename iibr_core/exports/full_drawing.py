"""Draw a picture from the photo at its own size, tile by tile.

The views of a tile lie around the eye, only as many as its lens needs; the renderer of the window draws it from them.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.full_size import LargePhoto, Part, tiles_of, views_of_tile, whole
from iibr_core.beyond.optics import CENTRE, Optics
from iibr_core.beyond.resized_light import mean_of_areas
from iibr_core.color import stored_from_encoded
from iibr_core.exports.full_picture import MAX_PIXELS, FullPicture, encode_light
from iibr_core.exports.render_settings import LensTile, RenderSettings
from iibr_core.exports.source import Draw
from iibr_core.method.view import Renderer
from iibr_core.runtime.work import raise_if_stopped, report_progress
from iibr_core.scenes.large_photo import complete_fills, load_large
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import LoadedPhoto, Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import FloatImage, GridShape, ImageSize, ViewOffset, ViewUpdate

TILE_PX = 768
"""Side of a tile in pixels of the photo, without the margin of its views."""
MARGIN_PX = 4
"""Margin of a tile's views beside parallax, in pixels, for the kernels."""
PARALLAX_PX = (1.5, 16.0)
"""Parallax within a tile from the eye to the border of the aperture, in pixels of the photo, above which the tile needs
views at the border, and above which it needs views half-way, too.
"""
DRAWING = "drawing at the photo's own size"


def draw_full(
    picture: FullPicture,
    draw: Draw,
    photo: LargePhoto | None = None,
    keep: Callable[[LargePhoto], None] = lambda photo: None,
) -> FloatImage:
    """Return the picture, linear light (height, width, 3).

    draw: draws a tile. photo: the photo as it was kept for an earlier picture. keep: is called with the photo once it
    is read, and again once its hidden surfaces are inpainted.
    """
    return _draw_tiles(picture, _read_photo(picture, photo, keep), draw)


def draw_picture(scene: Scene, loaded: LoadedPhoto, settings: RenderSettings, draw: Draw) -> NDArray[Any]:
    """Return the picture of these settings, (height, width, 3), drawn from the photo. draw: draws a tile."""
    assert scene.plan is not None, "a light field from disk has no photo"
    light = draw_full(FullPicture(scene, scene.plan, loaded, settings.optics, settings.size_px), draw)
    return encode_light(light, settings.is_linear, settings.color_space, scene.color_space)


def _read_photo(picture: FullPicture, photo: LargePhoto | None, keep: Callable[[LargePhoto], None]) -> LargePhoto:
    """Return the photo of a picture, with the hidden surfaces that its lens shows. See `draw_full`."""
    source, loaded, plan, optics = picture.scene.source, picture.loaded, picture.plan, picture.optics
    report_progress(0, 0, "reading the photo at its own size")
    if photo is None:
        photo = load_large(source, loaded, plan, MAX_PIXELS)
        keep(photo)
    if photo.fills is None and (optics.eye != CENTRE or optics.aperture_diameter > 0):
        photo = replace(photo, fills=complete_fills(source, loaded, plan))
        keep(photo)
    return photo


def _draw_tiles(picture: FullPicture, photo: LargePhoto, draw: Draw) -> FloatImage:
    """Return the picture, linear light (height, width, 3). draw: draws a tile."""
    height, width = photo.size
    top, left = picture.part.y * height, picture.part.x * width
    down, across = picture.part.height * height, picture.part.width * width
    pixels = Part(math.floor(top), math.ceil(top + down), math.floor(left), math.ceil(left + across))
    pixels = pixels.grown(0, whole(photo.size))
    light = np.empty((*pixels.size, 3), np.float32)
    tiles, renderer = tiles_of(pixels, TILE_PX), Renderer()
    for done, tile in enumerate(tiles):
        report_progress(done, len(tiles), DRAWING)
        light[tile.inside(pixels).slices] = draw(_tile_settings(picture, photo, tile, renderer))
        raise_if_stopped()
    report_progress(len(tiles), len(tiles), DRAWING)
    size = ImageSize(picture.size.height, picture.size.width)
    return mean_of_areas(light, size, (top - pixels.top, left - pixels.left, down, across))


def _tile_settings(picture: FullPicture, photo: LargePhoto, tile: Part, renderer: Renderer) -> RenderSettings:
    """Return the settings of a tile, with the views around the eye that its lens needs."""
    scene, eye = picture.scene, picture.optics.eye
    optics = picture.optics.with_focus_scaled(photo.size.width / scene.width)
    diameter = min(max(optics.aperture_diameter, 0.0), float(max(scene.grid)))
    rings, margin_px = _rings_of(photo, tile, optics, diameter / 2)
    step = diameter / 2 / rings if rings else max(diameter / 2, 1.0)
    around = tile.grown(min(margin_px, max(photo.size)), whole(photo.size))
    grid = GridShape(2 * rings + 1, 2 * rings + 1)
    places = list(np.ndindex(*grid))
    offsets = [ViewOffset(eye.t + step * (row - rings), eye.s + step * (column - rings)) for row, column in places]
    views = tuple(
        ViewUpdate(row, column, stored_from_encoded(view.colors, True), view.disparity * np.float32(step))
        for (row, column), view in zip(places, views_of_tile(photo, around, offsets, renderer))
    )
    gain = picture.optics.highlight_gain(picture.optics.aperture_diameter, scene.is_hdr)
    return RenderSettings(
        replace(optics.with_focus_scaled(step), eye=CENTRE, aperture_diameter=diameter / step),
        ScreenSize(tile.size.width, tile.size.height),
        _share_of(tile, photo.size),
        is_linear=True,
        color_space=scene.color_space,
        tile=LensTile(_share_of(around, photo.size), grid, views, gain),
    )


def _rings_of(photo: LargePhoto, tile: Part, optics: Optics, radius: float) -> tuple[int, int]:
    """Return the rings of views around the eye for a lens of this radius (view steps), and their margin in pixels."""
    farthest = photo.greatest_disparity
    steepest = abs(optics.focus_disparity) + sum(map(abs, optics.focus_tilt)) + max(optics.focus_range, 0.0)
    margin_px = MARGIN_PX + math.ceil(min(radius * (steepest + 1.5 * farthest), max(photo.size)))
    moved_px = math.ceil(min(max(map(abs, optics.eye)) * farthest, max(photo.size)))
    seen = photo.disparity[tile.grown(margin_px + moved_px, whole(photo.size)).slices]
    parallax_px = radius * float(seen.max() - seen.min())
    return sum(parallax_px > limit for limit in PARALLAX_PX), margin_px


def _share_of(part: Part, size: ImageSize) -> Rect:
    (height, width), (rows, columns) = size, part.size
    return Rect(part.left / width, part.top / height, columns / width, rows / height)
