"""The tilted plane of focus over the picture, and the plane through two handles.

Places are (x, y) from -1 to 1 across the picture, y down. A tilt is the change of the sharp disparity from the middle
to the right and to the lower border.
"""

from __future__ import annotations

import math
from dataclasses import replace
from typing import TYPE_CHECKING

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene

if TYPE_CHECKING:
    from viewer.model.lens import TiltHandles


Place = tuple[float, float]

MIN_HANDLE_DISTANCE = 0.1
"""Smallest distance of handles that define a slope, in half picture widths: closer handles would tip the plane over."""


def place_of(x_px: float, y_px: float, scene: Scene) -> Place:
    """Return the place of a pixel (centres at integers)."""
    return (2 * (x_px + 0.5) / scene.width - 1, 2 * (y_px + 0.5) / scene.height - 1)


def handle_points(handles: TiltHandles, picture: Rect) -> tuple[tuple[float, float], ...]:
    """Return the places of the two handles in the window."""
    return tuple(
        (picture.x + (x + 1) / 2 * picture.width, picture.y + (y + 1) / 2 * picture.height)
        for x, y in (handles.first, handles.second)
    )


def sharp_disparity(optics: Optics, place: Place) -> float:
    """Return the disparity (px per view step) that is sharp at a place."""
    return optics.focus_disparity + optics.focus_tilt[0] * place[0] + optics.focus_tilt[1] * place[1]


def focus_on(optics: Optics, place: Place, disparity: float) -> Optics:
    """Return the optics with the plane moved, not tilted, so that a disparity is sharp at a place."""
    return replace(optics, focus_disparity=optics.focus_disparity + disparity - sharp_disparity(optics, place))


def tilt_through(optics: Optics, moved: Place, disparity: float, kept: Place, aspect: float) -> Optics:
    """Return the optics with the plane through `disparity` at the moved handle and the sharp disparity at the kept one.

    The plane is level at right angles to the line between them. aspect: height / width of the picture.
    """
    there = sharp_disparity(optics, kept)
    across_x, across_y = moved[0] - kept[0], (moved[1] - kept[1]) * aspect
    distance = math.hypot(across_x, across_y)
    if distance < MIN_HANDLE_DISTANCE:
        return focus_on(optics, moved, disparity)
    slope = (disparity - there) / distance**2
    tilt = (slope * across_x, slope * across_y * aspect)
    return replace(optics, focus_tilt=tilt, focus_disparity=there - tilt[0] * kept[0] - tilt[1] * kept[1])
