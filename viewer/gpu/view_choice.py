"""Which stored views a picture is made of, and with what weights. Plain arrays, no GL; offsets in view steps (t, s).

Weights change smoothly with the eye and the aperture, so that nothing jumps while the user drags.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import GridShape, ViewOffset

MAX_SOURCES = 4


class Source(NamedTuple):
    """A stored view that takes part in a picture: its index, and its weight (all weights sum to 1)."""

    row: int
    column: int
    weight: float


class ApertureSample(NamedTuple):
    """A view that the aperture asks for, at `wanted`, and the stored one that answers: itself where it is present."""

    wanted: ViewOffset
    row: int
    column: int
    weight: float


def clamped_to_grid(eye: ViewOffset, grid: GridShape) -> ViewOffset:
    """The point of the grid's rectangle nearest to the eye."""
    first, last = grid.offset(0, 0), grid.offset(grid.rows - 1, grid.columns - 1)
    return ViewOffset(min(max(eye.t, first.t), last.t), min(max(eye.s, first.s), last.s))


def pinhole_sources(eye: ViewOffset, grid: GridShape, present: NDArray[np.bool_]) -> list[Source]:
    """Up to four views around the eye, nearest first: bilinear where the four corners of its cell are present.

    Elsewhere the nearest ones, weighted by reciprocal distance less that of the next view left out: continuous in the
    eye, and a stored view's own place belongs to it alone. present: (V, U) bool; empty if none is.
    """
    return _cell_corners(eye, grid, present) or _nearest_present(eye, grid, present)


def _cell_corners(eye: ViewOffset, grid: GridShape, present: NDArray[np.bool_]) -> list[Source]:
    inside = clamped_to_grid(eye, grid)
    v, u = inside.t + grid.centre[0], inside.s + grid.centre[1]
    rows, columns = _bracket(v, grid.rows), _bracket(u, grid.columns)
    corners = [Source(row, column, wv * wu) for row, wv in rows for column, wu in columns if wv * wu > 0]
    if not all(present[row, column] for row, column, _ in corners):
        return []
    return sorted(corners, key=lambda source: -source.weight)


def _bracket(index: float, count: int) -> list[tuple[int, float]]:
    low = min(int(index), max(count - 2, 0))
    fraction = index - low
    return [(low, 1 - fraction), (min(low + 1, count - 1), fraction)]


def _nearest_present(eye: ViewOffset, grid: GridShape, present: NDArray[np.bool_]) -> list[Source]:
    rows, columns = np.nonzero(present)
    if len(rows) == 0:
        return []
    distance = np.hypot(rows - grid.centre[0] - eye.t, columns - grid.centre[1] - eye.s)
    order = np.argsort(distance, kind="stable")[: MAX_SOURCES + 1]
    reach = 1 / distance[order[MAX_SOURCES]] if len(order) > MAX_SOURCES else 0.0
    closeness = np.maximum(1 / np.maximum(distance[order[:MAX_SOURCES]], 1e-6) - reach, 0)
    if closeness.sum() == 0:
        closeness[:] = 1
    weights = closeness / closeness.sum()
    return [Source(int(rows[i]), int(columns[i]), float(w)) for i, w in zip(order, weights) if w > 1e-5]


def aperture_samples(
    eye: ViewOffset, diameter: float, grid: GridShape, present: NDArray[np.bool_]
) -> list[ApertureSample]:
    """The grid's views inside a disc around the eye, its edge one view step wide. present: (V, U) bool, not all False.

    diameter: view steps, at least 1. The eye is clamped to the grid, and so never without a view.
    """
    eye = clamped_to_grid(eye, grid)
    v, u = np.mgrid[: grid.rows, : grid.columns]
    t, s = v - grid.centre[0], u - grid.centre[1]
    weights = np.clip(diameter / 2 + 0.5 - np.hypot(t - eye.t, s - eye.s), 0, 1)
    weights /= weights.sum()
    stand_in = nearest_present(present)
    return [
        ApertureSample(
            ViewOffset(float(t[at]), float(s[at])), int(stand_in[at][0]), int(stand_in[at][1]), float(weights[at])
        )
        for at in zip(*np.nonzero(weights > 1e-5))
    ]


def nearest_present(present: NDArray[np.bool_]) -> NDArray[np.intp]:
    """(V, U, 2): index of the present view nearest to each of the grid, the first in reading order among equals."""
    indices = np.argwhere(present)
    every = np.indices(present.shape).reshape(2, -1).T
    distances = ((every[:, None] - indices[None]) ** 2).sum(-1)
    return indices[distances.argmin(1)].reshape(*present.shape, 2)
