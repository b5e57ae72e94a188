"""Loops of the viewpoint through the grid."""

from __future__ import annotations

import math
from typing import Literal

from iibr_core.types import GridShape, ViewOffset

LOOP_REACH = 0.8
"""Of the grid's radius: the loops stay within what is stored."""


def point_on_loop(kind: LoopKind | None, turns: float, grid: GridShape) -> ViewOffset:
    """The viewpoint on a loop after so many turns, in view steps from the middle of the grid's views."""
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


LoopKind = Literal["circle", "eight", "swing"]


LOOPS: tuple[LoopKind, ...] = ("circle", "eight", "swing")
