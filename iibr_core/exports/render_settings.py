"""What a finished picture is asked for with."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

from iibr_core.rendering.optics import Optics
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace, InputError

MAX_PIXELS = 100_000_000
"""Of a picture: as float light it then takes 1.2 GB."""


class PictureCell(NamedTuple):
    """A part of the picture in texture coordinates."""

    left: float
    top: float
    right: float
    bottom: float

    def within(self, rows: PictureCell) -> PictureCell | None:
        """What of it lies in these rows, None if nothing."""
        top, bottom = max(self.top, rows.top), min(self.bottom, rows.bottom)
        return PictureCell(self.left, top, self.right, bottom) if top < bottom else None


WHOLE = PictureCell(0.0, 0.0, 1.0, 1.0)


class TargetWindow(NamedTuple):
    """The part of the picture that the targets hold, in texture coordinates."""

    left: float
    top: float
    width: float
    height: float

    def window(self, inner: TargetWindow) -> TargetWindow:
        """A part of what these targets hold, in texture coordinates of the picture. inner: in those of the targets."""
        left, top = self.left + inner.left * self.width, self.top + inner.top * self.height
        return TargetWindow(left, top, inner.width * self.width, inner.height * self.height)

    def in_target(self, cell: PictureCell) -> PictureCell:
        """A part of the picture in texture coordinates of the targets, as far as they hold it."""
        x = ((edge - self.left) / self.width for edge in (cell.left, cell.right))
        y = ((edge - self.top) / self.height for edge in (cell.top, cell.bottom))
        (left, right), (top, bottom) = ((min(max(edge, 0.0), 1.0) for edge in edges) for edges in (x, y))
        return PictureCell(left, top, right, bottom)


WHOLE_PICTURE = TargetWindow(0.0, 0.0, 1.0, 1.0)


@dataclass(frozen=True)
class RenderSettings:
    """A picture with every sample it will get, (height, width, 3).

    size_px: (width, height), any. part: what of the picture is drawn, stretched to size_px. is_linear: float32 linear
    light with 1 = white, not cut off at white or 0; else uint8, encoded by sRGB's curve. color_space: of the result.
    """

    optics: Optics
    size_px: ScreenSize
    part: TargetWindow = WHOLE_PICTURE
    is_linear: bool = False
    color_space: ColorSpace = SRGB


def require_size(size_px: ScreenSize) -> None:
    """Raise InputError for a picture (width, height) of no pixel or more than MAX_PIXELS."""
    width, height = size_px
    if min(size_px) < 1 or width * height > MAX_PIXELS:
        raise InputError(f"{width}x{height} px: a picture may have 1 to {MAX_PIXELS // 10**6} million pixels")
