"""The ray set that a photo begins with: its own rays, those beyond its frame, and the fringe of its mixed pixels."""

from __future__ import annotations

import numpy as np

from iibr_core.inpainting.outpainting import outpaint
from iibr_core.rendering.flying_pixels import measure_detail
from iibr_core.rendering.mixed_pixels import move_with_foreground, split_mixed_pixels
from iibr_core.rendering.ray_set import NO_MARGINS, RaySet
from iibr_core.stages import ALL_STAGES, Stages
from iibr_core.surfaces import EDGE_PX, SAME_SURFACE_PX, step_of
from iibr_core.types import FloatImage, Margins, ViewOffset, image_size

LEAST_STEP_PX = 0.1
"""Pixels behind smaller steps, down to this, move with the foreground; below it, steps are slopes and noise."""


def rays_of_photo(
    colors: FloatImage,
    disparity: FloatImage,
    farthest_views: float,
    more: int,
    margins: Margins = NO_MARGINS,
    stages: Stages = ALL_STAGES,
) -> RaySet:
    """The ray set of a photo: its own rays, and the fringe of its mixed pixels, with room for `more` images.

    farthest_views: the largest view offset that will be rendered; it decides which steps of disparity are depth edges.
    margins: so far beyond its frame the photo is continued. stages: that are on, here and in all views of these rays.

    """
    colors, disparity = outpaint(colors, disparity, margins, stages)
    centre, edge_step = ViewOffset(0.0, 0.0), step_of(EDGE_PX, farthest_views)
    detail = measure_detail(colors)
    size, surface_step = image_size(disparity), step_of(SAME_SURFACE_PX, farthest_views)
    rays = RaySet(2 + more, size, surface_step, farthest_views, margins, detail, stages)
    everywhere = np.ones(size, np.bool_)
    if not stages.split_mixed_pixels:
        rays.add(centre, colors, disparity, everywhere)
        return rays
    own, fringe, fringe_disparity, coverage = split_mixed_pixels(colors, disparity, edge_step)
    disparity = move_with_foreground(disparity, (step_of(LEAST_STEP_PX, farthest_views), edge_step))
    rays.add(centre, own, disparity, everywhere)
    if coverage.any():
        rays.add(centre, fringe, fringe_disparity, coverage)
    return rays
