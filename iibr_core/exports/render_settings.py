"""The settings of a finished picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace, InputError, ViewUpdate

if TYPE_CHECKING:
    from iibr_core.beyond.hidden_surfaces import HiddenSurface

MAX_PIXELS = 100_000_000
"""Largest number of pixels of a picture, and of the photo it is drawn from; as linear light it takes 1.2 GB."""


@dataclass(frozen=True, eq=False)
class LensTile:
    """The view of the eye, from which a tile of a large photo is drawn.

    window: the part of the photo that the view shows, as a share of it. highlight_gain: weight of clipped light beyond
    white. hidden: the surface behind the photo's, None if nothing shows it. hidden_scale: factor from its disparity to
    that of the view. behind_eye: (s, t) of the eye in view steps of the hidden surface.
    """

    window: Rect
    view: ViewUpdate
    highlight_gain: float
    hidden: HiddenSurface | None = None
    hidden_scale: float = 1.0
    behind_eye: tuple[float, float] = (0.0, 0.0)


@dataclass(frozen=True)
class RenderSettings:
    """Settings of a picture (height, width, 3) that is drawn with all its samples.

    part: the drawn part as a share of the picture, stretched to size_px. is_linear: whether the result is unclipped
    float32 light with 1 = white; otherwise it is uint8, encoded by sRGB's curve. color_space: of the result. tile:
    view to draw from, None for the views of the open scene.
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
