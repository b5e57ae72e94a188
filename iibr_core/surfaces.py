"""What "one surface", "in front" and "a depth edge" mean, for all between the map and the views.

A step of disparity parts its two sides by as many pixels in a view as that view is away, in view steps. Most steps are
judged once, in the outermost view: what is of one surface there is so everywhere.
"""

from __future__ import annotations

from iibr_core.runtime.jit import kernel

SAME_SURFACE_PX = 0.5
"""What parts by no more is of one surface: it lands as one, and look-ups meet it as one."""
EDGE_PX = 1.0
"""What parts by more is two surfaces, one in front of the other: between them is a depth edge, which mixes both."""
WIDE_EDGE_PX = 2.0
"""Where both sides part by more than this, nobody takes them for one: rays tear off there, and nothing is inpainted
from one side to the other.
"""
SLOPE_SHARE = 0.25
"""A step that goes on by more than this share of it on its other side, or on both, is a slope's and no edge."""


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
