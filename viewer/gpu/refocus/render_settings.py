"""What a finished picture is asked for with."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.types import SRGB, ColorSpace
from viewer.gpu.refocus.lens import WHOLE_PICTURE, TargetWindow
from viewer.model.layout import ScreenSize
from viewer.model.state.optics import Optics


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
