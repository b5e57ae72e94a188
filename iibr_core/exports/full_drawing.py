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
from iibr_core.beyond.optics import Optics
from iibr_core.color import stored_from_encoded
from iibr_core.exports.full_picture import FullPicture, encode_light, is_full
from iibr_core.exports.render_settings import MAX_PIXELS, LensTile, RenderSettings
from iibr_core.exports.source import Draw
from iibr_core.formats.images.resized_light import mean_of_areas
from iibr_core.method.view import Renderer
from iibr_core.runtime.work import raise_if_stopped, report_progress
from iibr_core.scenes.large_photo import complete_fills, hidden_of_photo, load_large
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import LoadedPhoto, Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import CENTRE, FloatImage, ImageSize, ViewUpdate

TILE_PX = 768
"""Side of a tile in pixels of the photo, without the margin of its views."""
MARGIN_PX, REDUCTION_SHARE = 16, 0.25
"""Margin of a tile beside its widest disc: in pixels, and as a share of the disc, which is drawn at a reduced size."""
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


def draw_picture(scene: Scene, loaded: LoadedPhoto | None, settings: RenderSettings, draw: Draw) -> NDArray[Any]:
    """Return the picture of these settings, (height, width, 3), drawn from the photo where that shows more, see
    `is_full`. draw: draws the picture from the views, or a tile.
    """
    if scene.plan is None or loaded is None or not is_full(scene, settings.optics, settings.size_px):
        return draw(settings)
    light = draw_full(FullPicture(scene, scene.plan, loaded, settings.optics, settings.size_px), draw)
    return encode_light(light, settings.is_linear, settings.color_space, scene.color_space)


def _read_photo(picture: FullPicture, photo: LargePhoto | None, keep: Callable[[LargePhoto], None]) -> LargePhoto:
    """Return the photo of a picture, with the hidden surfaces that its lens shows. See `draw_full`."""
    source, loaded, plan, optics = picture.scene.source, picture.loaded, picture.plan, picture.optics
    report_progress(0, 0, "reading the photo at its own size")
    if photo is None:
        photo = load_large(source, loaded, plan, MAX_PIXELS)
        keep(photo)
    is_open = optics.aperture_diameter > 0 and photo.hidden is None
    if photo.fills is None and (optics.eye != CENTRE or is_open):
        photo = replace(photo, fills=complete_fills(source, loaded, plan))
    if is_open:
        photo = replace(photo, hidden=hidden_of_photo(loaded, plan, picture.scene, photo.fills))
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
    """Return the settings of a tile, with the eye's view of it and what its discs reach."""
    scene, eye = picture.scene, picture.optics.eye
    enlarged = photo.size.width / scene.width
    optics = picture.optics.with_focus_scaled(enlarged)
    around = tile.grown(min(MARGIN_PX + _reach_px(photo, optics), max(photo.size)), whole(photo.size))
    if eye == CENTRE:
        colors, disparity = photo.pixels[around.slices], photo.disparity[around.slices]
    else:
        view = next(views_of_tile(photo, around, [eye], renderer))
        colors, disparity = view.colors, view.disparity
    return RenderSettings(
        replace(optics, eye=CENTRE),
        ScreenSize(tile.size.width, tile.size.height),
        _share_of(tile, photo.size),
        is_linear=True,
        color_space=scene.color_space,
        tile=LensTile(
            _share_of(around, photo.size),
            ViewUpdate(0, 0, stored_from_encoded(colors, True), disparity),
            picture.optics.highlight_gain(picture.optics.aperture_diameter, scene.is_hdr),
            photo.hidden,
            enlarged,
            (eye.s, eye.t),
        ),
    )


def _reach_px(photo: LargePhoto, optics: Optics) -> int:
    """Return the radius of the widest disc in pixels of the photo."""
    beside = np.abs(photo.range_px - np.float32(optics.focus_disparity)).max() + sum(map(abs, optics.focus_tilt))
    diameter = max(optics.aperture_diameter, 0.0) * (2**0.5 if optics.aperture_shape.kind == "mask" else 1.0)
    return math.ceil(min(diameter / 2 * float(beside), max(photo.size)) * (1 + REDUCTION_SHARE))


def _share_of(part: Part, size: ImageSize) -> Rect:
    (height, width), (rows, columns) = size, part.size
    return Rect(part.left / width, part.top / height, columns / width, rows / height)
