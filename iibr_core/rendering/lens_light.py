"""A picture through a lens at the photo's own size: what is in focus from views of that size, summed in linear light;
all else, which is too blurred to need more, from the same picture at the size of the light field.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from iibr_core.rendering.large_views import TILE_MARGIN_PX, TILE_PX, LargePhoto, Part, tiles_of, views_of_tile, whole
from iibr_core.rendering.renderer import Renderer
from iibr_core.rendering.resampling import keys_weights
from iibr_core.rendering.resized_light import ENLARGED_BY, bring_to
from iibr_core.runtime.jit import kernel, linear_scalar
from iibr_core.runtime.tiling import ShouldStop, in_bands, never
from iibr_core.types import FloatImage, ImageSize, ReportProgress, ViewOffset, ignore_progress, image_size

KERNEL_TAPS = 2
"""Pixels that the kernel reaches to each side."""
DRAWING = "drawing at the photo's own size"
ON_SURFACE_ROUNDS = 3
"""Of following a ray to what it shows, where a range of disparities is in focus."""
CENTRE = ViewOffset(0.0, 0.0)


@dataclass(frozen=True)
class LensSample:
    """A point of the lens. offset: from the eye, view steps. weight: of its light; all weights sum to 1."""

    offset: ViewOffset
    weight: float


@dataclass(frozen=True)
class LargeLens:
    """A lens for pictures of a `LargePhoto`.

    samples: none: a pinhole. share: of what they see in the picture, the rest is the pinhole's. diameter: in view
    steps. focus: the sharp disparity, px of the large photo per view step, in the picture's middle; tilt: how much it
    grows to its right and lower border; focus_range: so much to both sides is sharp too. sharp_up_to_px: width of the
    whole blur at which light begins to be left to the smaller picture, and at which all is. highlight_gain: what
    clipped light counts for beyond white. exposure: factor.
    """

    eye: ViewOffset = CENTRE
    samples: tuple[LensSample, ...] = ()
    share: float = 0.0
    diameter: float = 0.0
    focus: float = 0.0
    tilt: tuple[float, float] = (0.0, 0.0)
    focus_range: float = 0.0
    sharp_up_to_px: tuple[float, float] = (1.0, 2.0)
    highlight_gain: float = 0.0
    exposure: float = 1.0

    @property
    def offsets(self) -> list[ViewOffset]:
        """Of the views it needs: the eye's first, where it has a share, then those of the samples."""
        seen = [self.eye] if self.share < 1 else []
        if self.share > 0:
            seen += [ViewOffset(self.eye.t + at.offset.t, self.eye.s + at.offset.s) for at in self.samples]
        return seen


def largest_tile(size: ImageSize, lens: LargeLens, disparity_px: float) -> ImageSize:
    """What is read of a photo of (height, width) to draw a tile of it, at most. disparity_px: its greatest, either way,
    px of it per view step.
    """
    around_px = _around_px(size, lens, disparity_px)
    return ImageSize(*(min(side, TILE_PX + 2 * around_px) for side in size))


def _around_px(size: ImageSize, lens: LargeLens, disparity_px: float) -> int:
    """What is read around a tile, at most."""
    views = max([1.0, *(abs(axis) for offset in lens.offsets for axis in offset)])
    around_px = TILE_MARGIN_PX + math.ceil(min(max(size), abs(views * disparity_px)))
    return around_px + (math.ceil(min(max(size), _moved_px(lens))) + KERNEL_TAPS if lens.share > 0 else 0)


def _moved_px(lens: LargeLens) -> float:
    """How far what is in focus moves between the points of the lens, at most."""
    steepest = abs(lens.focus) + sum(map(abs, lens.tilt)) + lens.focus_range
    return max((steepest * abs(axis) for at in lens.samples for axis in at.offset), default=0.0)


def draw_large(
    photo: LargePhoto,
    lens: LargeLens,
    part: Part,
    renderer: Renderer,
    smaller: FloatImage | None = None,
    should_stop: ShouldStop = never,
    report_progress: ReportProgress = ignore_progress,
) -> FloatImage:
    """Linear light (h, w, 3), not cut off at white, of a part of the photo through a lens.

    smaller: (H', W', 3) linear light of the whole picture at the light field's size: where something is blurred, the
    result, made smaller, equals it. A lens with samples needs it. Raises Cancelled once should_stop is true.
    """
    light, tiles = np.zeros((*part.size, 3), np.float32), tiles_of(part)
    sharp = [_has_sharp(photo, lens, tile) for tile in tiles]
    around_px = _around_px(photo.size, lens, float(np.abs(photo.disparity).max(initial=0.0)))
    read = [math.prod(tile.grown(around_px, whole(photo.size)).size) for tile in tiles]
    views = [(lens.share < 1) + is_sharp * len(lens.samples) for is_sharp in sharp]
    done, total = 0, sum(pixels * count for pixels, count in zip(read, views))
    for tile, is_sharp, pixels in zip(tiles, sharp, read):
        for _ in _draw_tile(photo, lens, tile, is_sharp, renderer, should_stop, light[tile.inside(part).slices]):
            done += pixels
            report_progress(done, total, DRAWING)
    if smaller is not None:
        bring_to(light, smaller, part, photo.size, should_stop)
    return light


def _draw_tile(
    photo: LargePhoto,
    lens: LargeLens,
    tile: Part,
    is_sharp: bool,
    renderer: Renderer,
    should_stop: ShouldStop,
    light: FloatImage,
) -> Iterator[None]:
    """Add what a tile shows in focus to its light, one view of the lens after the other. is_sharp: whether any is."""
    if lens.share < 1:
        (view,) = views_of_tile(photo, tile, [lens.eye], renderer, should_stop)
        light += np.float32(1 - lens.share) * _linear(view.colors, lens, should_stop)
        yield
    if not is_sharp:
        return
    in_focus, weights = np.zeros_like(light), np.zeros(tile.size, np.float32)
    around = tile.grown(math.ceil(min(_moved_px(lens), max(photo.size))) + KERNEL_TAPS, whole(photo.size))
    views = views_of_tile(photo, around, lens.offsets[lens.share < 1 :], renderer, should_stop)
    for sample, view in zip(lens.samples, views):
        shown = _linear(view.colors, lens, should_stop)
        _add_in_bands(shown, view.disparity, around, lens, sample, tile, photo.size, in_focus, weights, should_stop)
        yield
    light += in_focus * (np.float32(lens.share) / np.maximum(weights, np.float32(1e-6)))[..., None]


def _has_sharp(photo: LargePhoto, lens: LargeLens, tile: Part) -> bool:
    """Whether anything that may show in a tile is in focus."""
    if not lens.share > 0:
        return False
    reach = math.ceil(max(map(abs, lens.eye)) * float(np.abs(photo.disparity).max(initial=0.0)))
    around = tile.grown(min(reach, max(photo.size)) + math.ceil(lens.sharp_up_to_px[1]), whole(photo.size))
    disparity = photo.disparity[around.slices]
    slack = lens.focus_range + sum(map(abs, lens.tilt)) + lens.sharp_up_to_px[1] / max(lens.diameter, 1e-9)
    return bool((np.abs(disparity - np.float32(lens.focus)) <= slack).any())


def _linear(encoded: FloatImage, lens: LargeLens, should_stop: ShouldStop) -> FloatImage:
    light = np.empty(encoded.shape, np.float32)

    def band(first: int, last: int) -> None:
        _linear_rows(encoded, lens.highlight_gain, lens.exposure, first, last, light)

    in_bands(band, image_size(encoded), should_stop)
    return light


def _add_in_bands(
    shown: FloatImage,
    disparity: FloatImage,
    around: Part,
    lens: LargeLens,
    sample: LensSample,
    tile: Part,
    size: ImageSize,
    light: FloatImage,
    weights: FloatImage,
    should_stop: ShouldStop,
) -> None:
    """Add what one sample sees in focus. around: what of the photo its view (shown, disparity) is of."""

    def band(first: int, last: int) -> None:
        _add_sharp(
            shown, disparity, around, tile, size, sample.offset, sample.weight,
            lens.focus, lens.tilt, lens.focus_range, lens.diameter, lens.sharp_up_to_px, first, last, light, weights,
        )  # fmt: skip

    in_bands(band, tile.size, should_stop)


@kernel
def _linear_rows(encoded, gain, exposure, first, last, light):
    """Linear light of rows [first, last), clipped colours brightened: see shaders/include/field.glsl."""
    for y in range(first, last):
        for x in range(encoded.shape[1]):
            r, g, b = (
                linear_scalar(encoded[y, x, 0]),
                linear_scalar(encoded[y, x, 1]),
                linear_scalar(encoded[y, x, 2]),
            )
            factor = exposure
            if gain > 0:
                clipped = min(max(20.0 * math.sqrt(max(min(r, g, b), 0.0)) - 19.0, 0.0), 1.0)
                factor *= 1.0 + gain * clipped * clipped
            light[y, x, 0], light[y, x, 1], light[y, x, 2] = factor * r, factor * g, factor * b


@kernel
def _add_sharp(
    shown, disparity, around, tile, size, offset, weight,
    focus, tilt, focus_range, diameter, sharp_up_to_px, first, last, light, weights,
):  # fmt: skip
    """Rows [first, last) of `_add_in_bands`; offset, weight: the sample's; all others: see `LargeLens`."""
    rows, columns = disparity.shape
    (t, s), (from_px, to_px), (height, width) = offset, sharp_up_to_px, size
    for row in range(first, last):
        for column in range(light.shape[1]):
            y, x = tile.top + row, tile.left + column
            focus_here = focus + tilt[0] * (2.0 * (x + 0.5) / width - 1.0) + tilt[1] * (2.0 * (y + 0.5) / height - 1.0)
            # Sheared to the focus; within a range that is in focus, to the disparity of what shows.
            sheared, d = focus_here, focus_here
            for _ in range(ON_SURFACE_ROUNDS if focus_range > 0 else 1):
                v = min(max(math.floor(y - sheared * t + 0.5) - around.top, 0), rows - 1)
                u = min(max(math.floor(x - sheared * s + 0.5) - around.left, 0), columns - 1)
                d = disparity[v, u]
                sheared = min(max(d, focus_here - focus_range), focus_here + focus_range)
            at_y, at_x = y - sheared * t, x - sheared * s
            # Beyond the view's border others know better.
            if not (-0.5 <= at_y <= height - 0.5 and -0.5 <= at_x <= width - 0.5):
                continue
            weights[row, column] += weight
            blur_px = diameter * max(abs(d - focus_here) - focus_range, 0.0)
            if not blur_px < to_px:
                continue
            share = weight * min((to_px - blur_px) / (to_px - from_px), 1.0)
            top, left = math.floor(at_y), math.floor(at_x)
            weights_x = keys_weights(at_x - left, ENLARGED_BY)
            weights_y = keys_weights(at_y - top, ENLARGED_BY)
            red = green = blue = 0.0
            for j in range(4):
                v = min(max(top + j - 1 - around.top, 0), rows - 1)
                for i in range(4):
                    u = min(max(left + i - 1 - around.left, 0), columns - 1)
                    w = weights_y[j] * weights_x[i]
                    red += w * shown[v, u, 0]
                    green += w * shown[v, u, 1]
                    blue += w * shown[v, u, 2]
            light[row, column, 0] += share * red
            light[row, column, 1] += share * green
            light[row, column, 2] += share * blue
