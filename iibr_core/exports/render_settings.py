"""The settings of a finished picture."""

from dataclasses import dataclass

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace, GridShape, InputError, ViewUpdate

MAX_PIXELS = 100_000_000
"""Largest number of pixels of a picture; as linear light it takes 1.2 GB."""


@dataclass(frozen=True, eq=False)
class LensTile:
    """Views around the eye, from which a tile of a large photo is drawn.

    window: the part of the photo that the views show, as a share of it. grid, views: in their own view steps.
    highlight_gain: weight of clipped light beyond white.
    """

    window: Rect
    grid: GridShape
    views: tuple[ViewUpdate, ...]
    highlight_gain: float


@dataclass(frozen=True)
class RenderSettings:
    """Settings of a picture (height, width, 3) that is drawn with all its samples.

    part: the drawn part as a share of the picture, stretched to size_px. is_linear: whether the result is unclipped
    float32 light with 1 = white; otherwise it is uint8, encoded by sRGB's curve. color_space: of the result. tile:
    views to draw from, None for the views of the open scene.
    """

    optics: Optics
    size_px: ScreenSize
    part: Rect = WHOLE
    is_linear: bool = False
    color_space: ColorSpace = SRGB
    tile: LensTile | None = None


def require_size(size_px: ScreenSize) -> None:
    """Raise InputError if a picture has no pixels or more than MAX_PIXELS."""
    width, height = size_px
    if min(size_px) < 1 or width * height > MAX_PIXELS:
        raise InputError(f"{width}x{height} px: a picture may have 1 to {MAX_PIXELS // 10**6} million pixels")
