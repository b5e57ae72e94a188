"""Positions of pinhole cameras in the aperture, and the places in a pixel at which they look.

Cameras for which views are made lie on a spiral (Vogel's sunflower): evenly spread, in no lines, with the centre and
the width (second moment) of the opening, so few cameras are coarser, never sharper or more blurred. A grid of samples
weighs stored views.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.aperture_shape import openness, reach_of
from iibr_core.beyond.optics import ApertureShape
from iibr_core.types import GridShape, ViewOffset

Points = NDArray[np.float64]

GRID_SIDE = 64
"""Number of samples across the opening from which its area, centre and width are computed."""

APERTURE_SIDE = 32
"""Number of samples across the opening that weigh stored views."""

GOLDEN_ANGLE = math.pi * (3 - math.sqrt(5))

SQRT_STEPS = (0.41421356237309515, 0.7320508075688772, 0.23606797749978969, 0.6457513110645906, 0.3166247903553998)
"""Steps of independent sequences: fractions of the roots of 2, 3, 5, 7 and 11."""


def fractions(first: int, count: int, steps: tuple[float, ...]) -> NDArray[np.float64]:
    """Return values 0..1 (count, len(steps)) of sequences with these steps, from number `first` on; number 0 is 0.5."""
    return np.asarray((np.arange(first, first + count)[:, None] * np.array(steps) + 0.5) % 1.0)


def aperture_points(shape: ApertureShape, diameter: float, widest: float, count: int) -> Points:
    """Return about `count` points (N, 2) of the aperture, as (t, s) from its middle, in view steps.

    diameter: view steps. widest: side of the square that cuts the opening off, view steps. An opening without points
    counts as a pinhole in its middle.
    """
    cut = min(widest / diameter, 1.0)
    samples, weights = _samples(shape, cut, GRID_SIDE)
    if weights.sum() == 0:
        return np.zeros((1, 2))
    centre = weights @ samples / weights.sum()
    moment = float(weights @ ((samples - centre) ** 2).sum(axis=-1)) / weights.sum() / 2
    area = min(float(weights.mean()) * 4 / math.pi, 1.0)
    points = _open_spiral(shape, cut, max(round(count / area), count))
    points = points - points.mean(axis=0)
    if (spread := float(np.mean(points**2))) > 0:
        points *= math.sqrt(moment / spread)
    # Scaled points stay in the circle around the opening: there may be no views outside it.
    beyond = np.hypot(*(points + centre).T) / (reach_of(shape, cut) / 2)
    return np.asarray(diameter * (points + centre) / np.maximum(beyond, 1.0)[:, None])


def views_in_aperture(shape: ApertureShape, diameter: float, eye: ViewOffset, grid: GridShape) -> NDArray[np.float64]:
    """Return weights (V, U) of a grid's views that an aperture around the eye adds up; their sum is 1.

    The opening is cut off to a square as wide as the longer side of the grid.
    """
    points, weights = _samples(shape, min(max(grid) / diameter, 1.0), APERTURE_SIDE)
    if (total := weights.sum()) == 0:
        return grid_weights(np.zeros((1, 2)), eye, grid)
    return grid_weights(diameter * points, eye, grid, weights / total)


def grid_weights(points: Points, eye: ViewOffset, grid: GridShape, shares: Points | None = None) -> Points:
    """Return weights (V, U) of a grid's views that replace cameras at points (N, 2) of the lens.

    Each camera counts 1, or its share (N,). The views around it share that bilinearly; outside the grid, those at its
    border count.
    """
    last = np.array(grid) - 1
    inside = np.clip(np.array(eye) + np.array(grid.centre) + points, 0, last)
    cell = np.minimum(np.floor(inside), np.maximum(last - 1, 0)).astype(np.intp)
    share = inside - cell
    weights = np.zeros(tuple(grid))
    for down, across in ((0, 0), (0, 1), (1, 0), (1, 1)):
        part = np.where(down, share[:, 0], 1 - share[:, 0]) * np.where(across, share[:, 1], 1 - share[:, 1])
        part = part if shares is None else part * shares
        np.add.at(weights, tuple(np.minimum(cell + np.array((down, across)), last).T), part)
    return weights


def _open_spiral(shape: ApertureShape, cut: float, count: int) -> Points:
    """Return those points of a spiral of `count` that lie in the opening, for a diameter of 1.

    Grey parts of a mask hold a share of their points.
    """
    numbers, reach = np.arange(count), reach_of(shape, cut)
    radius, angle = reach / 2 * np.sqrt((numbers + 0.5) / max(count, 1)), GOLDEN_ANGLE * numbers
    t, s = radius * np.sin(angle), radius * np.cos(angle)
    thresholds = fractions(0, count, SQRT_STEPS[2:3])[:, 0]
    return np.stack([t, s], axis=-1)[openness(shape, t, s, 1.0, cut, reach / GRID_SIDE) > thresholds]


def _samples(shape: ApertureShape, cut: float, side: int) -> tuple[Points, Points]:
    """Return a grid of points (N, 2) of an opening of diameter 1, and how open it is there (N,)."""
    reach = reach_of(shape, cut)
    places = reach * ((np.arange(side) + 0.5) / side - 0.5)
    t, s = (axis.ravel() for axis in np.meshgrid(places, places, indexing="ij"))
    return np.stack([t, s], axis=-1), openness(shape, t, s, 1.0, cut, reach / side)
