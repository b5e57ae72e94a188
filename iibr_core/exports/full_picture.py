"""A picture of a photo at its own size, or any up to it: drawn beside the window, from the photo on the disk."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import bytes_from_encoded, primaries_matrix, srgb_from_linear
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.generation.memory_model import budget_of, require_own_size
from iibr_core.generation.plan import ScenePlan
from iibr_core.rendering.optics import Optics
from iibr_core.runtime.tiling import ShouldStop, in_bands, never
from iibr_core.scenes.loaded_photo import LoadedPhoto
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ColorSpace, FloatImage, ImageSize, InputError, ReportProgress, ignore_progress, image_size

if TYPE_CHECKING:
    # What draws is imported by the thread that draws: the window comes first.
    from iibr_core.rendering.large_views import LargePhoto
    from iibr_core.rendering.ray_set import RaySet

MOST_PIXELS = 100_000_000
"""Of the photo; a larger one is read that large."""


@dataclass(frozen=True, eq=False)
class FullPicture:
    """A picture as it was asked for. size: of what comes out. smaller: (H, W, 3) linear light of the same picture at
    the scene's size, needed where `needs_smaller`. part: what of the picture is drawn, as a share of it.
    """

    scene: Scene
    plan: ScenePlan
    loaded: LoadedPhoto
    optics: Optics
    size: ScreenSize
    smaller: FloatImage | None = None
    part: Rect = WHOLE

    @property
    def smaller_settings(self) -> RenderSettings:
        """How `smaller` is drawn, from the scene's views."""
        return RenderSettings(self.optics, self.scene.size, is_linear=True, color_space=self.scene.color_space)

    def with_smaller(self, smaller: FloatImage) -> FullPicture:
        """The same with what it needs."""
        return replace(self, smaller=smaller)

    def draw(self, should_stop: ShouldStop = never, report_progress: ReportProgress = ignore_progress) -> FloatImage:
        """Linear light (height, width, 3). Raises InputError where the file is gone or another one by now, Cancelled
        once should_stop is true.
        """
        report_progress(0, 0, "reading the photo at its own size")
        photo = self.load(should_stop)
        if self.needs_fills:
            photo = photo.with_fills(self.fill(should_stop))
        return self.draw_from(photo, should_stop, report_progress)

    @property
    def needs_fills(self) -> bool:
        """Whether it shows what the photo hides."""
        from iibr_core.exports.large_lens import large_lens
        from iibr_core.rendering.lens_light import CENTRE

        return any(offset != CENTRE for offset in large_lens(self.optics, self.scene, 1.0).offsets)

    def load(self, should_stop: ShouldStop = never) -> LargePhoto:
        """What it is drawn from, without fills. Raises as `draw` does."""
        from iibr_core.scenes.large_photo import load_large

        return load_large(self.scene.source, self.loaded, self.plan, MOST_PIXELS, should_stop)

    def fill(self, should_stop: ShouldStop = never) -> RaySet | None:
        """What the photo hides. Raises as `draw` does."""
        from iibr_core.scenes.large_photo import complete_fills

        return complete_fills(self.scene.source, self.loaded, self.plan, should_stop)

    def draw_from(
        self, photo: LargePhoto, should_stop: ShouldStop = never, report_progress: ReportProgress = ignore_progress
    ) -> FloatImage:
        """The same as `draw`, of what was loaded for a picture of the same photo."""
        from iibr_core.exports.large_lens import large_lens
        from iibr_core.rendering.large_views import Part, whole
        from iibr_core.rendering.lens_light import draw_large
        from iibr_core.rendering.renderer import open_renderer
        from iibr_core.rendering.resized_light import mean_of_areas

        height, width = photo.size
        lens = large_lens(self.optics, self.scene, width / self.scene.width)
        top, left = self.part.y * height, self.part.x * width
        down, across = self.part.height * height, self.part.width * width
        pixels = Part(math.floor(top), math.ceil(top + down), math.floor(left), math.ceil(left + across))
        pixels = pixels.grown(0, whole(photo.size))
        with open_renderer(should_stop) as renderer:
            light = draw_large(photo, lens, pixels, renderer, self.smaller, should_stop, report_progress)
        size = ImageSize(self.size.height, self.size.width)
        return mean_of_areas(light, size, should_stop, (top - pixels.top, left - pixels.left, down, across))


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


def needs_smaller(optics: Optics) -> bool:
    """Whether the picture at the scene's size is part of the one at the photo's own: where anything is blurred."""
    return optics.aperture_diameter > 1


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
    from iibr_core.exports.large_lens import large_lens
    from iibr_core.formats.images.photo import size_within
    from iibr_core.rendering.lens_light import CENTRE, largest_tile

    if scene.plan is None or scene.own_size is None:
        return
    (width, height), (own_width, own_height) = scene.size, scene.own_size
    field_bytes = scene.plan.field_bytes if needs_smaller(optics) else 0
    budget = budget_of(scene.source.depth.memory_bytes)
    read = size_within(ImageSize(own_height, own_width), MOST_PIXELS)
    lens = large_lens(optics, scene, read.width / width)
    reach_px = max(map(abs, scene.disparity_range_px)) * read.width / width
    tile = largest_tile(read, lens, reach_px)
    shows_hidden = any(offset != CENTRE for offset in lens.offsets)
    require_own_size(budget, read, ImageSize(height, width), field_bytes, tile, shows_hidden)
