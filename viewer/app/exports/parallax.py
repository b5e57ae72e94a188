"""Pictures from a row of viewpoints, for displays and eyes: sheared, never toed in, what is in focus stays where it is.

What lies at the focus then lies in the surface of the screen. So that no picture shows what no view holds, all are cut
at the left and right by as much as the outermost is sheared.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from iibr_core.types import InputError, ViewOffset
from viewer.gpu.refocus.lens import TargetWindow
from viewer.model.export_settings import shear_margin
from viewer.model.state.optics import Optics
from viewer.model.state.scene import Scene

LEAST_WIDTH = 0.4
"""What of the picture's width must be left by the shear."""


@dataclass(frozen=True)
class SidePicture:
    """A picture from one viewpoint: a part of what that shows."""

    optics: Optics
    part: TargetWindow


def side_pictures(scene: Scene, optics: Optics, count: int, span_views: float) -> list[SidePicture]:
    """So many pictures, from the leftmost viewpoint to the rightmost. span_views: view steps from the first to the
    last, about the middle of the grid.

    Raises InputError where the focus lies so far from the plane that stays still that little would be left to see.
    """
    middle = (scene.grid.columns - 1) / 2 - scene.grid.centre[1]
    places = middle + (np.linspace(-span_views / 2, span_views / 2, count) if count > 1 else np.zeros(1))
    shears = -optics.focus_disparity * places / scene.width
    margin = shear_margin(scene, optics, span_views)
    width = 1 - 2 * margin
    if width < LEAST_WIDTH:
        moved = optics.focus_disparity * span_views
        raise InputError(
            f"{scene.name}: what is in focus moves by {moved:.0f} px from the first view to the last, too much to be"
            " held still; focus nearer to 0, or take fewer view steps"
        )
    return [
        SidePicture(
            replace(optics, eye=ViewOffset(optics.eye.t, float(s))),
            TargetWindow(margin + float(shear), 0.0, width, 1.0),
        )
        for s, shear in zip(places, shears)
    ]
