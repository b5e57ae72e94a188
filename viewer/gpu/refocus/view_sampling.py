"""Stored views that answer the cameras of a picture, with weights. Plain arrays, no GL; offsets in view steps (t, s).

Weights change smoothly with the eye and the aperture, so that nothing jumps while the user drags.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.aperture_sampling import Points, views_in_aperture
from iibr_core.beyond.optics import ApertureShape, Optics
from iibr_core.beyond.picture_quality import MAX_SOURCES, MIN_WEIGHT
from iibr_core.method.farthest_views import outer_views_of_grid
from iibr_core.scenes.lens_limits import clamp_to_grid
from iibr_core.scenes.scene import Scene
from iibr_core.types import GridShape, ViewOffset


class WeightedView(NamedTuple):
    """Index of a stored view that answers a pinhole, and its weight; all weights sum to 1."""

    row: int
    column: int
    weight: float


@dataclass(frozen=True, eq=False)
class Samples:
    """Cameras of a picture, each with the stored view that answers it.

    cameras: (N, 2) offsets (t, s) from the eye. views: (N, 2) row and column. weights: (N,), the picture is divided by
    their sum.
    """

    cameras: Points
    views: NDArray[np.intp]
    weights: NDArray[np.float64]

    def __len__(self) -> int:
        """Return the number of cameras."""
        return len(self.weights)

    def part(self, first: int, last: int) -> Samples:
        """Return samples number `first` up to, but without, number `last`."""
        span = slice(first, last)
        return Samples(self.cameras[span], self.views[span], self.weights[span])


def pinhole_sources(eye: ViewOffset, grid: GridShape, present: NDArray[np.bool_]) -> list[WeightedView]:
    """Return up to four views around the eye, nearest first: the corners of its cell if all are present.

    Otherwise these are the nearest views, weighted by reciprocal distance less that of the next view left out: weights
    are continuous in the eye, and at a stored view it counts alone. present: (V, U) bool.
    """
    return _cell_corners(eye, grid, present) or _nearest_present(eye, grid, present)


def views_seen(optics: Optics, grid: GridShape, has_disparity: bool = True) -> set[ViewOffset] | None:
    """Return the views of a grid that a converged picture through these optics shows, None for all.

    They are the corners of the eye's cell; an open lens also sees what the outer views show behind the centre view.
    has_disparity: whether the views have disparity; an open lens adds up views without it.
    """
    if optics.dolly != 0 or (optics.aperture_diameter > 0 and not has_disparity):
        return None
    corners = {grid.offset(row, column) for row, column, _ in _cell_corners(optics.eye, grid, np.ones(grid, bool))}
    return corners.union(outer_views_of_grid(grid)) if optics.aperture_diameter > 0 else corners


def views_seen_by(pictures: Iterable[Optics], scene: Scene) -> set[ViewOffset] | None:
    """Return the views that any of these pictures shows, None for all."""
    seen = [views_seen(optics, scene.grid, scene.has_view_disparity) for optics in pictures]
    return None if None in seen else set[ViewOffset]().union(*filter(None, seen))


def pinhole_samples(sources: list[WeightedView]) -> Samples:
    """Return the camera at the eye, answered by each of these views."""
    views = np.array([(source.row, source.column) for source in sources], np.intp)
    weights = np.array([source.weight for source in sources])
    return Samples(np.zeros((len(sources), 2)), views, weights / weights.sum())


def every_corner() -> Samples:
    """Return a camera at the eye for each corner of a cell; with dolly, cell and weights depend on the pixel."""
    zeros = np.zeros((MAX_SOURCES, 2))
    return Samples(zeros, zeros.astype(np.intp), np.full(MAX_SOURCES, 1 / MAX_SOURCES))


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
    share = index - low
    return [(low, 1 - share), (min(low + 1, count - 1), share)]


def _nearest_present(eye: ViewOffset, grid: GridShape, present: NDArray[np.bool_]) -> list[WeightedView]:
    rows, columns = np.nonzero(present)
    if len(rows) == 0:
        return []
    distance = np.hypot(rows - grid.centre[0] - eye.t, columns - grid.centre[1] - eye.s)
    order = np.argsort(distance, kind="stable")[: MAX_SOURCES + 1]
    # A view comes and goes with weight 0, so nothing jumps.
    reach = 1 / distance[order[MAX_SOURCES]] if len(order) > MAX_SOURCES else 0.0
    closeness = np.maximum(1 / np.maximum(distance[order[:MAX_SOURCES]], 1e-6) - reach, 0)
    if closeness.sum() == 0:
        closeness[:] = 1
    weights = closeness / closeness.sum()
    return [WeightedView(int(rows[i]), int(columns[i]), float(w)) for i, w in zip(order, weights) if w > 1e-5]


def blended_samples(
    shape: ApertureShape, diameter: float, eye: ViewOffset, grid: GridShape, present: NDArray[np.bool_]
) -> Samples:
    """Return the stored views that an open lens adds up: views without disparity cannot be warped.

    diameter: of the aperture, view steps. present: (V, U) bool, some True.
    """
    weights = np.zeros(tuple(grid))
    wanted = views_in_aperture(shape, diameter, eye, grid)
    np.add.at(weights, tuple(np.moveaxis(nearest_present(present), -1, 0)), wanted)
    views = np.argwhere(weights > MIN_WEIGHT)
    kept = weights[tuple(views.T)]
    cameras = views - np.array(grid.centre) - np.array(eye)
    return Samples(cameras.astype(np.float64), views, kept / kept.sum())


def nearest_present(present: NDArray[np.bool_]) -> NDArray[np.intp]:
    """Return, for each view of the grid, the index of the nearest present view: (V, U, 2).

    Neighbours alternate between equally near views, so that their errors do not all lie on one side.
    """
    return _nearest_present_of(present.tobytes(), (present.shape[0], present.shape[1]))


@lru_cache(maxsize=4)
def _nearest_present_of(present: bytes, shape: tuple[int, int]) -> NDArray[np.intp]:
    there = np.frombuffer(present, bool).reshape(shape)
    indices = np.argwhere(there)
    every = np.indices(shape).reshape(2, -1).T
    distances = ((every[:, None] - indices[None]) ** 2).sum(-1)
    is_nearest = distances == distances.min(1, keepdims=True)
    # The place in the grid decides between equally near views.
    turn = (every @ (1, 2)) % is_nearest.sum(1)
    chosen = (is_nearest & (np.cumsum(is_nearest, 1) == turn[:, None] + 1)).argmax(1)
    return np.asarray(indices[chosen]).reshape(*shape, 2)
