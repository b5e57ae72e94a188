"""Definitions of one surface, of "in front", and of a depth edge, for all steps from the map to the views.

A step of disparity moves its two sides apart in a view by the step times the view's distance in view steps. Most steps
are judged once, in the outermost view: pixels of one surface there belong together in all views.
"""

from __future__ import annotations

from iibr_core.runtime.kernels import kernel

SAME_SURFACE_PX = 0.5
"""Neighbours that move apart by at most this many pixels belong to one surface."""
EDGE_PX = 1.0
"""Neighbours that move apart by more than this many pixels are two surfaces with a depth edge between them."""
EDGE_SHARE = 0.03
"""Least depth edge, as a share of a map's range, if the views are not known yet."""
SMOOTH_SHARE = 0.8
"""Largest step of a smooth surface, as a share of the step between two surfaces."""
SLOPE_SHARE = 0.25
"""Largest difference of consecutive steps on one surface, as a share of the step; a change beside a step that exceeds
it makes the step a slope instead of a depth edge.
"""


def step_of(px: float, views: float) -> float:
    """Return the disparity difference that moves two pixels `px` apart in a view `views` steps away."""
    return px / max(views, 1e-9)


@kernel
def same_surface(disparity, other, step):
    """Return whether two disparities differ by at most a step; NaN belongs to no surface."""
    return abs(disparity - other) <= step


@kernel
def is_in_front(disparity, other, step):
    """Return whether a disparity is nearer than another by more than a step."""
    return disparity - other > step
