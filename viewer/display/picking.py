"""The disparity under the pointer, looked up on the processor in the disparity maps of present views."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage, GridShape, ViewOffset

LANDING_RADIUS_PX = 0.75
"""Largest distance between the pointer and a pixel under it: half the diagonal of a pixel, rounded up."""


def is_kept_for_picking(grid: GridShape, row: int, column: int) -> bool:
    """Return whether a view's disparity is kept: centre, corners and edge middles are never far from the eye."""
    v, u = grid.centre
    return row in (0, v, grid.rows - 1) and column in (0, u, grid.columns - 1)


def pick_disparity(maps: Mapping[ViewOffset, FloatImage], eye: ViewOffset, x_px: float, y_px: float) -> float | None:
    """Return the disparity (px per view step) seen at a pixel of the picture from the eye, None without maps.

    maps: disparity (H, W) by view offset, in distances between columns, as the eye. Each pixel of the view nearest to
    the eye lands where the eye would see it. The front-most pixel under the pointer counts; in a hole, the pixel that
    lands nearest.
    """
    if not maps:
        return None
    offset = min(maps, key=lambda o: (o.t - eye.t) ** 2 + (o.s - eye.s) ** 2)
    disparity, (t, s) = maps[offset], (eye.t - offset.t, eye.s - offset.s)
    # Only this part of the view, from the smallest to the largest shift, may land at the pointer.
    range_px = np.array([disparity.min(), disparity.max()], np.float64)
    rows, columns = (_span(at, n) for at, n in zip((y_px + range_px * t, x_px + range_px * s), disparity.shape))
    values = disparity[rows, columns]
    y, x = np.mgrid[rows, columns]
    distance = np.hypot(x - values * s - x_px, y - values * t - y_px)
    under = distance <= LANDING_RADIUS_PX
    return float(values[under].max() if under.any() else values.flat[distance.argmin()])


def _span(ends: NDArray[np.float64], size: int) -> slice:
    low, high = np.clip([np.floor(ends.min()) - 1, np.ceil(ends.max()) + 1], 0, size - 1).astype(int)
    return slice(low, high + 1)
