"""Whole pictures in frames of another shape, black where they leave room."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize


def draw_framed(source: ExportSource, settings: RenderSettings, frame_aspect: float | None = None) -> NDArray[Any]:
    """The picture whole and undistorted in a frame of the settings' size.

    frame_aspect: width / height that the frame is shown with, where that is another than its pixels'.
    """
    frame = settings.size_px
    size = size_in_frame(source.scene, frame, settings.part, frame_aspect)
    return centred(source.draw(replace(settings, size_px=size)), frame)


def centred(pixels: NDArray[Any], frame: ScreenSize, around: ArrayLike = 0) -> NDArray[Any]:
    """Pixels (H, W, 3) in the middle of a frame that is no smaller; around them one colour, (3) or grey, as they are
    encoded.
    """
    height, width = pixels.shape[:2]
    if (width, height) == frame:
        return pixels
    whole: NDArray[Any] = np.full((frame.height, frame.width, 3), around, pixels.dtype)
    top, left = (frame.height - height) // 2, (frame.width - width) // 2
    whole[top : top + height, left : left + width] = pixels
    return whole


def size_in_frame(scene: Scene, frame: ScreenSize, part: Rect = WHOLE, frame_aspect: float | None = None) -> ScreenSize:
    """Of a part of the scene's picture, whole in a frame; see `draw_framed`."""
    across, down = part.width * scene.width, part.height * scene.height
    is_rounded = scene.own_size is not None and scene.own_size.width > scene.width
    enlarged = frame.width / across if is_rounded else 1.0
    return fitted(across / down, frame, frame_aspect or frame.width / frame.height, enlarged)


def fitted(aspect: float, frame: ScreenSize, frame_aspect: float, enlarged: float = 1.0) -> ScreenSize:
    """The size of a picture of this aspect, whole in a frame that is shown with frame_aspect.

    enlarged: by so much views are that are smaller than the photo: the aspect comes of their whole numbers of pixels.
    Where that is all that leaves room beside the picture, it takes all: a photo at its own size fills its frame.
    """
    width, height = frame
    if aspect > frame_aspect:
        height = max(round(height * frame_aspect / aspect), 1)
    else:
        width = max(round(width * aspect / frame_aspect), 1)
    room = frame.width - width + frame.height - height
    return frame if room < 1 + max(enlarged, 1.0) else ScreenSize(width, height)
