"""The tilted plane of sharp focus over the picture, and the plane through two handles.

Places are (x, y) from -1 to 1 across the picture, y down; a tilt is the change of the sharp disparity from the middle
to the right and to the lower border.
"""

from __future__ import annotations

import math
from dataclasses import replace

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from viewer.model.state.lens import TiltHandles

Place = tuple[float, float]

CLOSEST_HANDLES = 0.1
"""Handles closer than this (half picture widths) give no slope: a small move would tip the plane over."""


def place_of(x_px: float, y_px: float, scene: Scene) -> Place:
    """The place of a pixel (centres at integers)."""
    return (2 * (x_px + 0.5) / scene.width - 1, 2 * (y_px + 0.5) / scene.height - 1)


def handle_points(handles: TiltHandles, picture: Rect) -> tuple[tuple[float, float], ...]:
    """Where the two handles are in the window."""
    return tuple(
        (picture.x + (x + 1) / 2 * picture.width, picture.y + (y + 1) / 2 * picture.height)
        for x, y in (handles.first, handles.second)
    )


def sharp_disparity(optics: Optics, place: Place) -> float:
    """The disparity (px per view step) that is sharp at this place."""
    return optics.focus_disparity + optics.focus_tilt[0] * place[0] + optics.focus_tilt[1] * place[1]


def focus_on(optics: Optics, place: Place, disparity: float) -> Optics:
    """The plane moved, not tilted, so that this disparity is sharp at this place."""
    return replace(optics, focus_disparity=optics.focus_disparity + disparity - sharp_disparity(optics, place))


def tilt_through(optics: Optics, moved: Place, disparity: float, kept: Place, aspect: float) -> Optics:
    """The plane through `disparity` at the moved handle and what is sharp at the kept one; level across that line.

    aspect: the picture's height / width, so that "across" means what the eye sees.
    """
    there = sharp_disparity(optics, kept)
    across_x, across_y = moved[0] - kept[0], (moved[1] - kept[1]) * aspect
    distance = math.hypot(across_x, across_y)
    if distance < CLOSEST_HANDLES:
        return focus_on(optics, moved, disparity)
    slope = (disparity - there) / distance**2
    tilt = (slope * across_x, slope * across_y * aspect)
    return replace(optics, focus_tilt=tilt, focus_disparity=there - tilt[0] * kept[0] - tilt[1] * kept[1])
