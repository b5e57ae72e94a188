"""What a finished picture is asked for with."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.rendering.optics import Optics
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace, GridShape, InputError, ViewUpdate

MAX_PIXELS = 100_000_000
"""Of a picture: as float light it then takes 1.2 GB."""


@dataclass(frozen=True, eq=False)
class LensTile:
    """Views around the eye that show a part of a large photo: a tile of it is drawn from them.

    window: the part, as a share of the photo. grid, views: in view steps of their own. highlight_gain: what clipped
    light counts for beyond white.
    """

    window: Rect
    grid: GridShape
    views: tuple[ViewUpdate, ...]
    highlight_gain: float


@dataclass(frozen=True)
class RenderSettings:
    """A picture with every sample it will get, (height, width, 3).

    size_px: (width, height), any. part: what is drawn, as a share of the picture, stretched to size_px. is_linear:
    float32 linear light with 1 = white, not cut off at white or 0; else uint8, encoded by sRGB's curve. color_space: of
    the result. tile: what it is drawn from, None for the views that are open.
    """

    optics: Optics
    size_px: ScreenSize
    part: Rect = WHOLE
    is_linear: bool = False
    color_space: ColorSpace = SRGB
    tile: LensTile | None = None


def require_size(size_px: ScreenSize) -> None:
    """Raise InputError for a picture (width, height) of no pixel or more than MAX_PIXELS."""
    width, height = size_px
    if min(size_px) < 1 or width * height > MAX_PIXELS:
        raise InputError(f"{width}x{height} px: a picture may have 1 to {MAX_PIXELS // 10**6} million pixels")
