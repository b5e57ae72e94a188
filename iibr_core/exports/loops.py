"""Loops of the viewpoint through the grid."""

import math
from typing import Literal

from iibr_core.types import GridShape, ViewOffset

LoopKind = Literal["circle", "eight", "swing"]
LOOPS: tuple[LoopKind, ...] = ("circle", "eight", "swing")
LOOP_REACH = 0.8
"""Radius of the loops as a share of the grid's, so that they stay within the stored views."""


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
