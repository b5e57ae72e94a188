"""A picture of a photo at its own size, or any up to it: drawn tile by tile, from views made of the photo on the disk.

A tile's views lie around the eye, only as many as its lens needs. What draws the window's pictures draws it from them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import bytes_from_encoded, primaries_matrix, srgb_from_linear, stored_from_encoded
from iibr_core.exports.render_settings import LensTile, RenderSettings
from iibr_core.exports.source import Draw
from iibr_core.generation.memory import require_memory
from iibr_core.generation.plan import ScenePlan
from iibr_core.rendering.optics import CENTRE, Optics
from iibr_core.runtime.tiling import ShouldStop, in_bands, never, raise_if_stopped
from iibr_core.scenes.loaded_photo import LoadedPhoto
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import (
    ColorSpace,
    FloatImage,
    GridShape,
    ImageSize,
    InputError,
    ReportProgress,
    ViewOffset,
    ViewUpdate,
    ignore_progress,
    image_size,
)

if TYPE_CHECKING:
    # What draws is imported by the thread that draws: the window comes first.
    from iibr_core.rendering.large_views import LargePhoto, Part
    from iibr_core.rendering.ray_set import RaySet
    from iibr_core.rendering.renderer import Renderer

MAX_PIXELS = 100_000_000
"""Greatest number of the photo's pixels; a larger photo is read that large."""

OWN_SIZE_BYTES = 60
"""Of a pixel of a picture at the photo's own size, while it is drawn."""
TILE_PX = 768
"""Side of a tile in pixels of the photo, without what its views show around it."""

MARGIN_PX = 4
"""Margin of a tile's views beside parallax, in pixels: kernels reach so far."""

PARALLAX_PX = (1.5, 16.0)
"""Parallax within a tile from the eye to the border of the aperture, in pixels of the photo, above which the tile needs
views there, and above which it needs others half-way, too.
"""

DRAWING = "drawing at the photo's own size"


@dataclass(frozen=True, eq=False)
class FullPicture:
    """A picture as it was asked for. size: of what comes out. part: what of the picture is drawn, as a share of it."""

    scene: Scene
    plan: ScenePlan
    loaded: LoadedPhoto
    optics: Optics
    size: ScreenSize
    part: Rect = WHOLE

    def make(
        self, draw: Draw, should_stop: ShouldStop = never, report_progress: ReportProgress = ignore_progress
    ) -> FloatImage:
        """Linear light (height, width, 3). draw: draws the tiles. Raises InputError where the file is gone or another
        one by now, Cancelled once should_stop is true.
        """
        report_progress(0, 0, "reading the photo at its own size")
        photo = self.load(should_stop)
        if self.needs_fills:
            photo = photo.with_fills(self.fill(should_stop))
        return self.make_from(photo, draw, should_stop, report_progress)

    @property
    def needs_fills(self) -> bool:
        """Whether it shows what the photo hides."""
        return _shows_hidden(self.optics)

    def load(self, should_stop: ShouldStop = never) -> LargePhoto:
        """Read the photo at its own size, without fills. Raises as `make` does."""
        from iibr_core.scenes.large_photo import load_large

        return load_large(self.scene.source, self.loaded, self.plan, MAX_PIXELS, should_stop)

    def fill(self, should_stop: ShouldStop = never) -> RaySet | None:
        """Make the rays that the photo hides, None where it hides nothing. Raises as `make` does."""
        from iibr_core.scenes.large_photo import complete_fills

        return complete_fills(self.scene.source, self.loaded, self.plan, should_stop)

    def make_from(
        self,
        photo: LargePhoto,
        draw: Draw,
        should_stop: ShouldStop = never,
        report_progress: ReportProgress = ignore_progress,
    ) -> FloatImage:
        """The same as `make`, of what was loaded for a picture of the same photo."""
        from iibr_core.rendering.large_views import Part, tiles_of, whole
        from iibr_core.rendering.renderer import open_renderer
        from iibr_core.rendering.resized_light import mean_of_areas

        height, width = photo.size
        top, left = self.part.y * height, self.part.x * width
        down, across = self.part.height * height, self.part.width * width
        pixels = Part(math.floor(top), math.ceil(top + down), math.floor(left), math.ceil(left + across))
        pixels = pixels.grown(0, whole(photo.size))
        light = np.empty((*pixels.size, 3), np.float32)
        tiles = tiles_of(pixels, TILE_PX)
        with open_renderer(should_stop) as renderer:
            for done, tile in enumerate(tiles):
                report_progress(done, len(tiles), DRAWING)
                light[tile.inside(pixels).slices] = draw(self.tile_settings(photo, tile, renderer, should_stop))
                raise_if_stopped(should_stop)
        report_progress(len(tiles), len(tiles), DRAWING)
        size = ImageSize(self.size.height, self.size.width)
        return mean_of_areas(light, size, should_stop, (top - pixels.top, left - pixels.left, down, across))

    def tile_settings(
        self, photo: LargePhoto, tile: Part, renderer: Renderer, should_stop: ShouldStop = never
    ) -> RenderSettings:
        """A tile of the photo, and the views that its lens needs. Raises Cancelled once should_stop is true."""
        from iibr_core.rendering.large_views import views_of_tile, whole

        lens = _lens_of(self.optics, self.scene, photo, tile)
        around = tile.grown(min(lens.margin_px, max(photo.size)), whole(photo.size))
        middle = lens.grid.centre[0]
        places = [(row, column) for row in range(lens.grid.rows) for column in range(lens.grid.columns)]
        eye = self.optics.eye
        offsets = [ViewOffset(eye.t + lens.step * (v - middle), eye.s + lens.step * (u - middle)) for v, u in places]
        made = views_of_tile(photo, around, offsets, renderer, should_stop)
        views = tuple(
            ViewUpdate(*place, stored_from_encoded(view.colors, True), view.disparity * np.float32(lens.step))
            for place, view in zip(places, made)
        )
        gain = self.optics.highlight_gain(self.optics.aperture_diameter, self.scene.is_hdr)
        return RenderSettings(
            lens.optics,
            ScreenSize(tile.size.width, tile.size.height),
            _share_of(tile, photo.size),
            is_linear=True,
            color_space=self.scene.color_space,
            tile=LensTile(_share_of(around, photo.size), lens.grid, views, gain),
        )


@dataclass(frozen=True)
class _TileLens:
    """Views of a tile and the lens over them. step: view steps of the scene from view to view. optics: in these steps,
    with the eye in the middle. margin_px: what the views show around the tile, pixels of the photo.
    """

    grid: GridShape
    step: float
    optics: Optics
    margin_px: int


def _lens_of(optics: Optics, scene: Scene, photo: LargePhoto, tile: Part) -> _TileLens:
    from iibr_core.rendering.large_views import whole

    enlarged = photo.size.width / scene.width
    diameter = min(max(optics.aperture_diameter, 0.0), float(max(scene.grid)))
    reach, focus = diameter / 2, optics.with_focus_scaled(enlarged)
    farthest = photo.greatest_disparity
    steepest = abs(focus.focus_disparity) + sum(map(abs, focus.focus_tilt)) + max(focus.focus_range, 0.0)
    margin_px = MARGIN_PX + math.ceil(min(reach * (steepest + 1.5 * farthest), max(photo.size)))
    moved_px = math.ceil(min(max(map(abs, optics.eye)) * farthest, max(photo.size)))
    seen = photo.disparity[tile.grown(margin_px + moved_px, whole(photo.size)).slices]
    steps = sum(reach * float(seen.max() - seen.min()) > limit for limit in PARALLAX_PX)
    step = reach / steps if steps else max(reach, 1.0)
    scaled = replace(focus.with_focus_scaled(step), eye=CENTRE, aperture_diameter=diameter / step)
    return _TileLens(GridShape(2 * steps + 1, 2 * steps + 1), step, scaled, margin_px)


def _shows_hidden(optics: Optics) -> bool:
    return optics.eye != CENTRE or optics.aperture_diameter > 0


def _share_of(part: Part, size: ImageSize) -> Rect:
    (height, width), (rows, columns) = size, part.size
    return Rect(part.left / width, part.top / height, columns / width, rows / height)


def encode_light(
    light: FloatImage, is_linear: bool, target: ColorSpace, source: ColorSpace, should_stop: ShouldStop = never
) -> NDArray[Any]:
    """Light (H, W, 3) of one colour space in another: bytes, encoded by sRGB's curve, or light as it is.

    Raises Cancelled once should_stop is true.
    """
    encoded = np.empty(light.shape, np.float32 if is_linear else np.uint8)
    matrix = primaries_matrix(target, source)

    def band(first: int, last: int) -> None:
        rows = light[first:last]
        converted = rows if target == source else rows @ matrix.T
        encoded[first:last] = converted if is_linear else bytes_from_encoded(srgb_from_linear(converted))

    in_bands(band, image_size(light), should_stop)
    return encoded


def is_full(scene: Scene, optics: Optics, size: ScreenSize) -> bool:
    """Whether a picture of this size is drawn from the photo at its own size: it shows more than the scene's views
    hold, and there is memory for that. With a dolly or gloss it is drawn from the views, whatever its size.
    """
    if optics.dolly != 0 or optics.gloss is not None:
        return False
    if scene.plan is None or scene.own_size is None or math.prod(size) <= math.prod(scene.size):
        return False
    if math.prod(scene.own_size) <= math.prod(scene.size):
        return False
    try:
        require_full(scene, optics)
    except InputError:
        return False
    return True


def require_full(scene: Scene, optics: Optics) -> None:
    """Raise InputError where there is no memory for a picture at the photo's own size."""
    from iibr_core.formats.images.photo import size_within

    if scene.plan is None or scene.own_size is None:
        return
    own_width, own_height = scene.own_size
    read = size_within(ImageSize(own_height, own_width), MAX_PIXELS)
    require_memory(math.prod(read) * OWN_SIZE_BYTES, f"a picture at the photo's own size, {read},")
