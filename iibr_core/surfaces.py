"""What "one surface", "in front" and "a depth edge" mean, for all between the map and the views.

A step of disparity parts its two sides by as many pixels in a view as that view is away, in view steps. Most steps are
judged once, in the outermost view: what is of one surface there is so everywhere.
"""

from __future__ import annotations

from iibr_core.runtime.kernels import kernel

SAME_SURFACE_PX = 0.5
"""What parts by no more is of one surface: it lands as one, and look-ups meet it as one."""
EDGE_PX = 1.0
"""What parts by more is two surfaces, one in front of the other: between them is a depth edge, which mixes both."""
EDGE_SHARE = 0.03
"""Of a map's range: a larger step is a depth edge where no views are known yet."""
SMOOTH_SHARE = 0.8
"""A smooth surface's steps stay below this share of the step that parts surfaces."""
SLOPE_SHARE = 0.25
"""What changes by more than this share of a step beside it makes a slope of it, no depth edge; on a surface, steps that
follow each other differ by no more.
"""


def step_of(px: float, views: float) -> float:
    """The step of disparity that parts its sides by so many pixels in a view so many view steps away."""
    return px / max(views, 1e-9)


@kernel
def same_surface(disparity, other, step):
    """Whether two disparities differ by no more than a step. NaN, no surface, is of none."""
    return abs(disparity - other) <= step


@kernel
def is_in_front(disparity, other, step):
    """Whether a disparity is nearer than another by more than a step."""
    return disparity - other > step
