"""The disparity under the pointer, looked up on the processor in the disparity maps of present views."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from iibr_core.types import FloatImage, GridShape, ViewOffset

LANDING_RADIUS_PX = 0.75
"""Largest distance between the pointer and a pixel under it: half the diagonal of a pixel, rounded up."""


def is_kept_for_picking(grid: GridShape, row: int, column: int) -> bool:
    """Return whether a view's disparity is kept: centre, corners and edge middles are never far from the eye."""
    v, u = grid.centre
    return row in (0, v, grid.rows - 1) and column in (0, u, grid.columns - 1)


def pick_disparity(maps: Mapping[ViewOffset, FloatImage], eye: ViewOffset, x_px: float, y_px: float) -> float | None:
    """Return the disparity (px per view step) seen at a pixel of the picture from the eye, None without maps.

    maps: disparity (H, W) by view offset. Each pixel of the view nearest to the eye lands where the eye would see it.
    The front-most pixel under the pointer counts; in a hole, the pixel that lands nearest.
    """
    if not maps:
        return None
    offset = min(maps, key=lambda o: (o.t - eye.t) ** 2 + (o.s - eye.s) ** 2)
    step = ViewOffset(eye.t - offset.t, eye.s - offset.s)
    return _disparity_at(maps[offset], step, x_px, y_px)


def _disparity_at(disparity: FloatImage, step: ViewOffset, x_px: float, y_px: float) -> float:
    rows, columns = _landing_area(disparity, step, x_px, y_px)
    values = disparity[rows, columns]
    y, x = np.mgrid[rows, columns]
    distance = np.hypot(x - values * step.s - x_px, y - values * step.t - y_px)
    under = distance <= LANDING_RADIUS_PX
    return float(values[under].max() if under.any() else values.flat[distance.argmin()])


def _landing_area(disparity: FloatImage, step: ViewOffset, x_px: float, y_px: float) -> tuple[slice, slice]:
    """Return the part of the view that may land at the pointer, from the smallest to the largest shift."""
    range_px = np.array([disparity.min(), disparity.max()], np.float64)
    height, width = disparity.shape
    return _span(y_px + range_px * step.t, height), _span(x_px + range_px * step.s, width)


def _span(ends: np.ndarray, size: int) -> slice:
    low = int(np.clip(np.floor(ends.min()) - 1, 0, size - 1))
    high = int(np.clip(np.ceil(ends.max()) + 1, 0, size - 1))
    return slice(low, high + 1)
