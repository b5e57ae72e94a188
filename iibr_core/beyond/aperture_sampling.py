"""Positions of a picture's pinhole cameras in the aperture.

Each pass has a spiral of cameras (Vogel's sunflower), turned and shifted from pass to pass, so its points are evenly
spread, alone and with those of other passes, and form no lines. The first spiral, which may be the only one, is moved
and scaled until it has the centre and the width (second moment) of the opening: a picture of few cameras is coarser,
never sharper or more blurred. The others are not, because few cameras a pass would leave the middle and the border
empty.
"""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.aperture_shape import openness
from iibr_core.beyond.optics import ApertureShape
from iibr_core.types import GridShape, ViewOffset

Points = NDArray[np.float64]

GRID_SIDE = 64
"""Number of samples across the opening from which its area, centre and width are computed."""

EDGE = 1 / GRID_SIDE
"""Width of the opening's antialiased edge, as a share of the circle around it."""

GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))
TURN_STEP, SHIFT_STEP = 0.7548776662466927, 0.5698402909980532
"""Steps from pass to pass (R2): turn, as a share of a full turn, and shift along the spiral, in points."""

SQRT_STEPS = (0.41421356237309515, 0.7320508075688772, 0.23606797749978969, 0.6457513110645906, 0.3166247903553998)
"""Steps of independent sequences: fractions of the roots of 2, 3, 5, 7 and 11."""

COARSENESS_VARIANCE = 1 / 12
"""Second moment of a square with a side of 1, per axis: each camera is blurred by its share of the aperture."""


def fractions(first: int, count: int, steps: tuple[float, ...]) -> NDArray[np.float64]:
    """Return values 0..1 (count, len(steps)) of sequences with these steps, from number `first` on; number 0 is 0.5."""
    return np.asarray((np.arange(first, first + count)[:, None] * np.array(steps) + 0.5) % 1.0)


def aperture_points(
    shape: ApertureShape, diameter: float, widest: float, count: int, pass_index: int, cell: float = 0.0
) -> Points:
    """Return about `count` points (N, 2) of the aperture for one pass, as (t, s) from its middle, in view steps.

    diameter: view steps. widest: side of the square that cuts the opening off, view steps. cell: side of the square of
    the aperture that a camera stands for, view steps; its picture is blurred by as much. An opening without points
    counts as a pinhole in its middle.
    """
    cut = min(widest / diameter, 1.0)
    area, centre, moment = _measure(shape, cut)
    points = _open_spiral(shape, cut, max(round(count / area), count) if area > 0 else 0, pass_index)
    if len(points) == 0:
        return np.zeros((1, 2))
    points = points - (points.mean(axis=0) if pass_index == 0 else centre)
    spread = float(np.mean(points**2)) if pass_index == 0 else moment
    if spread > 0:
        points *= math.sqrt(max(moment - COARSENESS_VARIANCE * (cell / diameter) ** 2, 0.0) / spread)
    # Scaled points stay in the circle around the opening: there may be no views outside it.
    beyond = np.hypot(*(points + centre).T) / (_reach(shape, cut) / 2)
    return np.asarray(diameter * (points + centre) / np.maximum(beyond, 1.0)[:, None])


def open_area(shape: ApertureShape, diameter: float, widest: float) -> float:
    """Return the area of the opening in square view steps. Arguments: see `aperture_points`."""
    cut = min(widest / diameter, 1.0)
    return _measure(shape, cut)[0] * math.pi / 4 * (diameter * _reach(shape, cut)) ** 2


def grid_weights(points: Points, eye: ViewOffset, grid: GridShape) -> NDArray[np.float64]:
    """Return weights (V, U) of a grid's views that replace cameras at points (N, 2) of the lens; their sum is N.

    Each camera is shared bilinearly by the views around it; outside the grid, the views at its border count.
    """
    last = np.array(grid) - 1
    inside = np.clip(np.array(eye) + np.array(grid.centre) + points, 0, last)
    cell = np.minimum(np.floor(inside), np.maximum(last - 1, 0)).astype(np.intp)
    share = inside - cell
    weights = np.zeros(tuple(grid))
    for down, across in ((0, 0), (0, 1), (1, 0), (1, 1)):
        part = np.where(down, share[:, 0], 1 - share[:, 0]) * np.where(across, share[:, 1], 1 - share[:, 1])
        np.add.at(weights, tuple(np.minimum(cell + np.array((down, across)), last).T), part)
    return weights


def _open_spiral(shape: ApertureShape, cut: float, count: int, pass_index: int) -> Points:
    """Return those points of a spiral of `count` that lie in the opening, for a diameter of 1.

    Grey parts of a mask hold a share of their points.
    """
    numbers, reach = np.arange(count), _reach(shape, cut)
    radius = reach / 2 * np.sqrt((numbers + (0.5 + pass_index * SHIFT_STEP) % 1.0) / max(count, 1))
    angle = GOLDEN_ANGLE * numbers + 2 * math.pi * TURN_STEP * pass_index
    t, s = radius * np.sin(angle), radius * np.cos(angle)
    thresholds = fractions(pass_index * count, count, SQRT_STEPS[2:3])[:, 0]
    return np.stack([t, s], axis=-1)[openness(shape, t, s, 1.0, cut, EDGE * reach) > thresholds]


def _reach(shape: ApertureShape, cut: float) -> float:
    """Return the diameter of the circle around the opening, which includes a mask's corners, for a diameter of 1."""
    return math.sqrt(2) * min(cut, 1.0) if shape.kind == "mask" else min(math.sqrt(2) * cut, 1.0)


@lru_cache(maxsize=32)
def _measure(shape: ApertureShape, cut: float) -> tuple[float, Points, float]:
    """Return the opening's area, as a share of the circle around it, its centre (t, s) and its second moment.

    The moment is about the centre and per axis, for a diameter of 1.
    """
    reach = _reach(shape, cut)
    places = reach * ((np.arange(GRID_SIDE) + 0.5) / GRID_SIDE - 0.5)
    t, s = (axis.ravel() for axis in np.meshgrid(places, places, indexing="ij"))
    weights = openness(shape, t, s, 1.0, cut, EDGE * reach)
    total = float(weights.sum())
    if total == 0:
        return 0.0, np.zeros(2), 0.0
    points = np.stack([t, s], axis=-1)
    centre = weights @ points / total
    moment = float(weights @ ((points - centre) ** 2).sum(axis=-1)) / total / 2
    return min(float(weights.mean()) * 4 / math.pi, 1.0), centre, moment
