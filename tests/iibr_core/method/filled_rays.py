"""Inpainted rays of a view, for tests: as they join the ray set."""

import numpy as np


def filled_rays(view):
    """Return colours (H, W, 3), disparity and coverage (H, W) of a view: what lies behind counts at its pixels."""
    colors, disparity, coverage = view.colors.copy(), view.disparity.copy(), view.occluded.astype(np.float32)
    if view.behind is not None:
        colors.reshape(-1, 3)[view.behind.pixel] = view.behind.colors
        disparity.reshape(-1)[view.behind.pixel] = view.behind.disparity
        coverage.reshape(-1)[view.behind.pixel] = 1
    return colors, disparity, coverage
