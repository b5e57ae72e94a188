"""Paths over time: loops of the viewpoint through the grid, and the easing of glides."""

import math
from typing import Literal

from iibr_core.types import GridShape, ViewOffset

LoopKind = Literal["circle", "eight", "swing"]
LOOPS: tuple[LoopKind, ...] = ("circle", "eight", "swing")
LOOP_REACH = 0.8
"""Radius of the loops as a share of the grid's, so that they stay within the stored views."""
RACK_HOLD = 0.2
"""Time that a focus rack rests at each end of a glide, as a share of half a turn."""


def ease(share: float) -> float:
    """Map 0..1 to 0..1, slow at both ends; numbers beyond count as the ends."""
    x = min(max(share, 0.0), 1.0)
    return x * x * (3 - 2 * x)


def rack_share(turn: float) -> float:
    """Return the position of a focus rack: 0 at its first surface, 1 at its second. A turn, 0..1, is there and back."""
    return ease((1 - abs(1 - 2 * turn) - RACK_HOLD) / (1 - 2 * RACK_HOLD))


def point_on_loop(kind: LoopKind | None, turns: float, grid: GridShape) -> ViewOffset:
    """Return the viewpoint on a loop about the middle of the grid after this number of turns; None swings."""
    angle = 2 * math.pi * turns
    match kind:
        case "circle":
            down, right = -math.cos(angle), math.sin(angle)
        case "eight":
            down, right = math.sin(2 * angle) / 2, math.sin(angle)
        case _:
            down, right = 0.0, math.sin(angle)
    (rows, columns), (v, u) = grid, grid.centre
    radius_t, radius_s = LOOP_REACH * (rows - 1) / 2, LOOP_REACH * (columns - 1) / 2
    return ViewOffset((rows - 1) / 2 - v + down * radius_t, (columns - 1) / 2 - u + right * radius_s)
