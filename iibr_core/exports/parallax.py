"""Pictures from a row of viewpoints, for displays and eyes: sheared, never toed in, what is in focus stays where it is.

What lies at the focus then lies in the surface of the screen. So that no picture shows what no view holds, all are cut
at the left and right by as much as the outermost is sheared.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.settings import shear_margin
from iibr_core.scenes.rect import Rect
from iibr_core.scenes.scene import Scene
from iibr_core.types import InputError, ViewOffset

LEAST_WIDTH = 0.4
"""What of the picture's width must be left by the shear."""


def side_pictures(scene: Scene, settings: RenderSettings, count: int, span_views: float) -> list[RenderSettings]:
    """So many pictures, from the leftmost viewpoint to the rightmost. settings: of each, but for viewpoint and part.
    span_views: view steps from the first to the last, about the middle of the grid.

    Raises InputError where the focus lies so far from the plane that stays still that little would be left to see.
    """
    optics = settings.optics
    middle = (scene.grid.columns - 1) / 2 - scene.grid.centre[1]
    places = middle + (np.linspace(-span_views / 2, span_views / 2, count) if count > 1 else np.zeros(1))
    shears = -optics.focus_disparity * places / scene.width
    margin = shear_margin(scene, optics, span_views)
    width = 1 - 2 * margin
    if width < LEAST_WIDTH:
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
