"""Which stored views a picture is made of, and with what weights. Plain arrays, no GL; offsets in view steps (t, s).

Weights change smoothly with the eye and the aperture, so that nothing jumps while the user drags.
"""

from __future__ import annotations

import math
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.rendering import ApertureShape, openness
from iibr_core.scenes import clamp_to_grid
from iibr_core.types import GridShape, ViewOffset
from viewer.gpu.refocus.aperture_moments import scale_of

MAX_SOURCES = 4
DISC = ApertureShape()
UNMOVED = ViewOffset(0.0, 0.0)
LEAST_WEIGHT = 2e-4
"""A sample that counts for less is not worth its drawing: it changes white by a twentieth of an 8-bit step."""


class WeightedView(NamedTuple):
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


def pinhole_sources(eye: ViewOffset, grid: GridShape, present: NDArray[np.bool_]) -> list[WeightedView]:
    """Up to four views around the eye, nearest first: bilinear where the four corners of its cell are present.

    Elsewhere the nearest ones, weighted by reciprocal distance less that of the next view left out: continuous in the
    eye, and a stored view's own place belongs to it alone. present: (V, U) bool; empty if none is.
    """
    return _cell_corners(eye, grid, present) or _nearest_present(eye, grid, present)


def pinhole_weights(sources: list[WeightedView], eyes: list[ViewOffset], grid: GridShape) -> NDArray[np.float64]:
    """(sources, eyes): bilinear weights for other eyes in the same cell; where the sources are no cell's, as given."""
    rows, columns = {source.row for source in sources}, {source.column for source in sources}
    if max(rows) - min(rows) > 1 or max(columns) - min(columns) > 1 or len(sources) != len(rows) * len(columns):
        return np.repeat([[source.weight] for source in sources], len(eyes), axis=1)
    inside = [clamp_to_grid(eye, grid) for eye in eyes]
    v, u = (np.array([eye[axis] + grid.centre[axis] for eye in inside]) for axis in (0, 1))
    weights = np.ones((len(sources), len(eyes)))
    for i, source in enumerate(sources):
        weights[i] *= 1 - np.abs(source.row - v) if len(rows) > 1 else 1.0
        weights[i] *= 1 - np.abs(source.column - u) if len(columns) > 1 else 1.0
    return weights


def _cell_corners(eye: ViewOffset, grid: GridShape, present: NDArray[np.bool_]) -> list[WeightedView]:
    inside = clamp_to_grid(eye, grid)
    v, u = inside.t + grid.centre[0], inside.s + grid.centre[1]
    rows, columns = _bracket(v, grid.rows), _bracket(u, grid.columns)
    corners = [WeightedView(row, column, wv * wu) for row, wv in rows for column, wu in columns if wv * wu > 0]
    if not all(present[row, column] for row, column, _ in corners):
        return []
    return sorted(corners, key=lambda source: -source.weight)


def _bracket(index: float, count: int) -> list[tuple[int, float]]:
    low = min(int(index), max(count - 2, 0))
    fraction = index - low
    return [(low, 1 - fraction), (min(low + 1, count - 1), fraction)]


def _nearest_present(eye: ViewOffset, grid: GridShape, present: NDArray[np.bool_]) -> list[WeightedView]:
    rows, columns = np.nonzero(present)
    if len(rows) == 0:
        return []
    distance = np.hypot(rows - grid.centre[0] - eye.t, columns - grid.centre[1] - eye.s)
    order = np.argsort(distance, kind="stable")[: MAX_SOURCES + 1]
    # Less the closeness of the next view left out: a view comes and goes with weight 0, so nothing jumps.
    reach = 1 / distance[order[MAX_SOURCES]] if len(order) > MAX_SOURCES else 0.0
    closeness = np.maximum(1 / np.maximum(distance[order[:MAX_SOURCES]], 1e-6) - reach, 0)
    if closeness.sum() == 0:
        closeness[:] = 1
    weights = closeness / closeness.sum()
    return [WeightedView(int(rows[i]), int(columns[i]), float(w)) for i, w in zip(order, weights) if w > 1e-5]


def aperture_samples(
    eye: ViewOffset,
    diameter: float,
    grid: GridShape,
    present: NDArray[np.bool_],
    shape: ApertureShape = DISC,
    stride: int = 1,
    moved: ViewOffset = UNMOVED,
    is_smoothed: bool = False,
) -> list[ApertureSample]:
    """Places of a square lattice inside the aperture around the eye. present: (V, U) bool, not all False.

    diameter: view steps, at least 1; beyond the grid's own it is cut to a square. stride: view steps between places,
    each weighted by what the aperture leaves of its square. moved: where the lattice lies, (0, 0) = on the stored
    views, those of the centre view's row and column among them. What lies off the grid is answered by its border.
    is_smoothed: whether what is drawn will be spread over what lies between places. With or without, it blurs as wide
    as the aperture asks for: see `aperture_moments`.
    """
    width, widest = min(float(stride), diameter), float(max(grid))
    place = math.remainder(moved.t - eye.t, stride), math.remainder(moved.s - eye.s, stride)
    scale = scale_of(shape, place, diameter, widest, stride, is_smoothed)
    diameter, widest = scale * diameter, scale * widest
    reach = min(diameter, widest) / 2 + stride
    # The lattice around the eye, one place beyond the opening: soft edges reach there.
    t, s = np.meshgrid(*(_lattice(middle, reach, stride, start) for middle, start in zip(eye, moved)), indexing="ij")
    weights = openness(shape, t - eye.t, s - eye.s, diameter, widest, width)
    if weights.sum() <= 0:  # a mask's hole, or one smaller than the samples
        weights = (np.hypot(t - eye.t, s - eye.s) == np.hypot(t - eye.t, s - eye.s).min()).astype(float)
    chosen = weights > LEAST_WEIGHT * weights.sum()
    weights /= weights[chosen].sum()
    fallback_view = nearest_present(present)
    return [
        ApertureSample(wanted, *_fallback_view(wanted, grid, fallback_view), weight)
        for wanted, weight in zip(map(ViewOffset, t[chosen].tolist(), s[chosen].tolist()), weights[chosen].tolist())
    ]


def _lattice(middle: float, reach: float, stride: int, start: float) -> NDArray[np.float64]:
    first, last = math.ceil((middle - reach - start) / stride), math.floor((middle + reach - start) / stride)
    return start + stride * np.arange(first, last + 1, dtype=float)


def _fallback_view(wanted: ViewOffset, grid: GridShape, fallback_view: NDArray[np.intp]) -> tuple[int, int]:
    row = min(max(math.floor(wanted.t + 0.5) + grid.centre[0], 0), grid.rows - 1)
    column = min(max(math.floor(wanted.s + 0.5) + grid.centre[1], 0), grid.columns - 1)
    return int(fallback_view[row, column, 0]), int(fallback_view[row, column, 1])


def nearest_present(present: NDArray[np.bool_]) -> NDArray[np.intp]:
    """(V, U, 2): index of the present view nearest to each of the grid.

    Neighbours take turns among equally near ones, lest all their errors lie on one side.
    """
    return _nearest_present_of(present.tobytes(), (present.shape[0], present.shape[1]))


@lru_cache(maxsize=4)
def _nearest_present_of(present: bytes, shape: tuple[int, int]) -> NDArray[np.intp]:
    there = np.frombuffer(present, bool).reshape(shape)
    indices = np.argwhere(there)
    every = np.indices(shape).reshape(2, -1).T
    distances = ((every[:, None] - indices[None]) ** 2).sum(-1)
    is_nearest = distances == distances.min(1, keepdims=True)
    # Ties: which of the equally near ones, by the place in the grid.
    turn = (every @ (1, 2)) % is_nearest.sum(1)
    chosen = (is_nearest & (np.cumsum(is_nearest, 1) == turn[:, None] + 1)).argmax(1)
    return np.asarray(indices[chosen]).reshape(*shape, 2)
