"""Ray sets of the photo's viewpoint, and inpainted rays of a view, for tests."""

import numpy as np

from iibr_core.method.rays import RaySet
from iibr_core.types import ViewOffset, image_size


def ray_set(*disparities, colors=None, coverage=None, farthest=1.0, room=0):
    """Return rays of maps (H, W), which the photo's viewpoint sees. room: number of images that can be added."""
    maps = [np.asarray(values, np.float32) for values in disparities]
    rays = RaySet(len(maps) + room, image_size(maps[0]), farthest)
    for values in maps:
        seen = np.zeros((*values.shape, 3), np.float32) if colors is None else colors
        rays.add(ViewOffset(0.0, 0.0), seen, values, np.ones_like(values) if coverage is None else coverage)
    return rays


def filled_rays(view):
    """Return colours (H, W, 3), disparity and coverage (H, W) of a view: what lies behind counts at its pixels."""
    colors, disparity, coverage = view.colors.copy(), view.disparity.copy(), view.occluded.astype(np.float32)
    if view.behind is not None:
        colors.reshape(-1, 3)[view.behind.pixel] = view.behind.colors
        disparity.reshape(-1)[view.behind.pixel] = view.behind.disparity
        coverage.reshape(-1)[view.behind.pixel] = 1
    return colors, disparity, coverage
