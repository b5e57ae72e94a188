"""Which disparity lies under the pointer, looked up on the CPU in the disparity maps of views that are there."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from iibr_core.types import FloatImage, GridShape, ViewOffset

LANDING_RADIUS_PX = 0.75
"""A pixel that lands this close to the pointer is under it: the half diagonal of a pixel, rounded up."""


def is_kept_for_picking(grid: GridShape, row: int, column: int) -> bool:
    """Whether this view's disparity is worth keeping: centre, corners and edge middles are never far from the eye."""
    v, u = grid.centre
    return row in (0, v, grid.rows - 1) and column in (0, u, grid.columns - 1)


def pick_disparity(maps: Mapping[ViewOffset, FloatImage], eye: ViewOffset, x_px: float, y_px: float) -> float | None:
    """Disparity (px per view step) seen at a pixel of the picture from the eye; None without maps.

    maps: disparity (H, W) by view offset. Each pixel of the view nearest to the eye lands where the eye would see it;
    the front-most of those under the pointer counts, and the nearest landing where none is (a hole).
    """
    if not maps:
        return None
    offset = min(maps, key=lambda o: (o.t - eye.t) ** 2 + (o.s - eye.s) ** 2)
    step = ViewOffset(eye.t - offset.t, eye.s - offset.s)
    return _disparity_at(maps[offset], step, x_px, y_px)


def _disparity_at(disparity: FloatImage, step: ViewOffset, x_px: float, y_px: float) -> float:
    rows, columns = _rows_and_columns_that_may_land(disparity, step, x_px, y_px)
    values = disparity[rows, columns]
    y, x = np.mgrid[rows, columns]
    distance = np.hypot(x - values * step.s - x_px, y - values * step.t - y_px)
    under = distance <= LANDING_RADIUS_PX
    return float(values[under].max() if under.any() else values.flat[distance.argmin()])


def _rows_and_columns_that_may_land(
    disparity: FloatImage, step: ViewOffset, x_px: float, y_px: float
) -> tuple[slice, slice]:
    """The part of the view that can land at the pointer: between the least and the greatest shift, and a bit wider."""
    range_px = np.array([disparity.min(), disparity.max()], np.float64)
    height, width = disparity.shape
    return _span(y_px + range_px * step.t, height), _span(x_px + range_px * step.s, width)


def _span(ends: np.ndarray, size: int) -> slice:
    low = int(np.clip(np.floor(ends.min()) - 1, 0, size - 1))
    high = int(np.clip(np.ceil(ends.max()) + 1, 0, size - 1))
    return slice(low, high + 1)
