"""Views of a grid that pictures show, found before any view is made."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.lens_limits import clamp_to_grid
from iibr_core.types import GridShape, ViewOffset


def views_seen(optics: Optics, grid: GridShape) -> set[ViewOffset] | None:
    """Return the views of a grid that a converged picture through these optics shows, None for all.

    They are the corners of all cells of the grid in which the circle around the aperture lies.
    """
    if optics.dolly != 0:
        return None
    eye = clamp_to_grid(optics.eye, grid) if optics.aperture_diameter == 0 else optics.eye
    rows, columns = (np.arange(count) - middle for count, middle in zip(grid, grid.centre))
    # Views at the border stand for those beyond it.
    t, s = (np.abs(axis - np.clip(at, axis[0], axis[-1])) for axis, at in zip((rows, columns), eye))
    reach = max(optics.aperture_diameter, 0.0) / 2 * (math.sqrt(2) if optics.aperture_shape.kind == "mask" else 1.0)
    beside = np.hypot(np.maximum(t[:, None] - 1, 0), np.maximum(s - 1, 0))
    is_corner = (t[:, None] < 1 + reach) & (s < 1 + reach) & (beside <= reach)
    return {grid.offset(int(row), int(column)) for row, column in np.argwhere(is_corner)}


def views_seen_by(pictures: Iterable[Optics], grid: GridShape) -> set[ViewOffset] | None:
    """Return the views that any of these pictures shows, None for all."""
    seen = set[ViewOffset]()
    for optics in pictures:
        found = views_seen(optics, grid)
        if found is None:
            return None
        seen |= found
    return seen
