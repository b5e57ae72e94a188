"""Pictures fitted into frames of another shape, and pictures from a row of viewpoints for displays and eyes."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from iibr_core.exports.kinds import shear_margin
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import InputError, ViewOffset

MIN_WIDTH = 0.4
"""Smallest share of the picture's width that the shear may leave."""


def draw_framed(source: ExportSource, settings: RenderSettings, frame_aspect: float | None = None) -> NDArray[Any]:
    """Return the whole, undistorted picture in a frame of the settings' size, (H, W, 3), with black bars.

    frame_aspect: width / height of the displayed frame, if its pixels are not square.
    """
    frame = settings.size_px
    size = size_in_frame(source.scene, frame, settings.part, frame_aspect)
    return centred(source.draw(replace(settings, size_px=size)), frame)


def centred(pixels: NDArray[Any], frame: ScreenSize, around: ArrayLike = 0) -> NDArray[Any]:
    """Return pixels (H, W, 3) in the middle of a frame that is at least as large.

    around: the colour of the bars, (3) or grey, encoded like the pixels.
    """
    height, width = pixels.shape[:2]
    if (width, height) == frame:
        return pixels
    whole: NDArray[Any] = np.full((frame.height, frame.width, 3), around, pixels.dtype)
    top, left = (frame.height - height) // 2, (frame.width - width) // 2
    whole[top : top + height, left : left + width] = pixels
    return whole


def size_in_frame(scene: Scene, frame: ScreenSize, part: Rect = WHOLE, frame_aspect: float | None = None) -> ScreenSize:
    """Return the size at which a part of the scene's picture fills a frame, see `draw_framed`."""
    across, down = part.width * scene.width, part.height * scene.height
    is_rounded = scene.own_size is not None and scene.own_size.width > scene.width
    enlarged = frame.width / across if is_rounded else 1.0
    return fitted(across / down, frame, frame_aspect or frame.width / frame.height, enlarged)


def fitted(aspect: float, frame: ScreenSize, frame_aspect: float, enlarged: float = 1.0) -> ScreenSize:
    """Return the largest size of a picture of this aspect in a frame that is displayed with `frame_aspect`.

    enlarged: factor from the views, whose aspect is rounded to whole pixels, to the picture. Bars that come from the
    rounding only are left out, so that a photo at its own size fills its frame.
    """
    width, height = frame
    if aspect > frame_aspect:
        height = max(round(height * frame_aspect / aspect), 1)
    else:
        width = max(round(width * aspect / frame_aspect), 1)
    bars = frame.width - width + frame.height - height
    return frame if bars < 1 + max(enlarged, 1.0) else ScreenSize(width, height)


def side_pictures(scene: Scene, settings: RenderSettings, count: int, span_views: float) -> list[RenderSettings]:
    """Return the settings of `count` pictures from the leftmost viewpoint to the rightmost.

    The pictures are sheared, never toed in: the focused surface stays in place and lies in the plane of the screen. All
    pictures are cropped by the largest shear, so none shows pixels that do not exist.

    settings: those of every picture, apart from viewpoint and part. span_views: view steps from the first viewpoint to
    the last, about the middle of the grid.
    """
    optics = settings.optics
    middle = (scene.grid.columns - 1) / 2 - scene.grid.centre[1]
    places = middle + (np.linspace(-span_views / 2, span_views / 2, count) if count > 1 else np.zeros(1))
    shears = -optics.focus_disparity * places / scene.width
    margin = shear_margin(scene, optics, span_views)
    width = 1 - 2 * margin
    if width < MIN_WIDTH:
        moved = optics.focus_disparity * span_views
        raise InputError(
            f"{scene.name}: the focused surface moves by {moved:.0f} px from the first view to the last, too much for"
            " a common frame; focus nearer to 0, or take fewer view steps"
        )
    return [
        replace(
            settings,
            optics=replace(optics, eye=ViewOffset(optics.eye.t, float(s))),
            part=Rect(margin + float(shear), 0.0, width, 1.0),
        )
        for s, shear in zip(places, shears)
    ]
