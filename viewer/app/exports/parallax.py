"""Pictures from a row of viewpoints, for displays and eyes: sheared, never toed in, what is in focus stays where it is.

What lies at the focus then lies in the surface of the screen. So that no picture shows what no view holds, all are cut
at the left and right by as much as the outermost is sheared.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from iibr_core.types import InputError, ViewOffset
from viewer.gpu.refocus.lens import TargetWindow
from viewer.model.layout import ScreenSize
from viewer.model.state.app_state import Scene
from viewer.model.state.optics import Optics

LEAST_WIDTH = 0.4
"""What of the picture's width must be left by the shear."""


@dataclass(frozen=True)
class SidePicture:
    """A picture from one viewpoint. aspect: width / height of what it shows."""

    optics: Optics
    part: TargetWindow
    aspect: float


def side_pictures(scene: Scene, optics: Optics, count: int, span_views: float | None = None) -> list[SidePicture]:
    """So many pictures, from the leftmost viewpoint to the rightmost. span_views: view steps from the first to the
    last, the whole grid by default.

    Raises InputError where the focus lies so far from the plane that stays still that little would be left to see.
    """
    columns, (_, centre) = scene.grid.columns, scene.grid.centre
    span = float(columns - 1) if span_views is None else span_views
    middle = (columns - 1) / 2 - centre
    places = np.linspace(middle - span / 2, middle + span / 2, count) if count > 1 else np.array([middle])
    shears = -optics.focus_disparity * places / scene.width
    margin = float(np.abs(shears).max())
    width = 1 - 2 * margin
    if width < LEAST_WIDTH:
        moved = optics.focus_disparity * span
        raise InputError(
            f"{scene.name}: what is in focus moves by {moved:.0f} px from the first view to the last, too much to be"
            " held still; focus nearer to 0, or take fewer view steps"
        )
    return [
        SidePicture(
            replace(optics, eye=ViewOffset(optics.eye.t, float(s))),
            TargetWindow(margin + float(shear), 0.0, width, 1.0),
            width * scene.width / scene.height,
        )
        for s, shear in zip(places, shears)
    ]


def fitted(aspect: float, frame: ScreenSize, frame_aspect: float) -> ScreenSize:
    """The size of a picture of this aspect, whole in a frame (width, height) that is displayed with frame_aspect."""
    width, height = frame
    if aspect > frame_aspect:
        return ScreenSize(width, max(round(height * frame_aspect / aspect), 1))
    return ScreenSize(max(round(width * aspect / frame_aspect), 1), height)
