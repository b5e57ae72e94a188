"""Views of a grid that pictures show, found before any view is made."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from iibr_core.beyond.optics import Optics
from iibr_core.method.farthest_views import outer_views_of_grid
from iibr_core.scenes.lens_limits import clamp_to_grid
from iibr_core.scenes.scene import Scene
from iibr_core.types import GridShape, ViewOffset


def views_seen(optics: Optics, grid: GridShape, has_disparity: bool = True) -> set[ViewOffset] | None:
    """Return the views of a grid that a converged picture through these optics shows, None for all.

    They are the corners of the eye's cell; an open lens also sees what the outer views show behind the centre view.
    has_disparity: whether the views have disparity; an open lens adds up views without it.
    """
    if optics.dolly != 0 or (optics.aperture_diameter > 0 and not has_disparity):
        return None
    eye = clamp_to_grid(optics.eye, grid)
    rows, columns = (np.arange(count) - middle for count, middle in zip(grid, grid.centre))
    is_corner = (np.abs(rows - eye.t)[:, None] < 1) & (np.abs(columns - eye.s) < 1)
    corners = {grid.offset(int(row), int(column)) for row, column in np.argwhere(is_corner)}
    return corners.union(outer_views_of_grid(grid)) if optics.aperture_diameter > 0 else corners


def views_seen_by(pictures: Iterable[Optics], scene: Scene) -> set[ViewOffset] | None:
    """Return the views that any of these pictures shows, None for all."""
    seen = set[ViewOffset]()
    for optics in pictures:
        found = views_seen(optics, scene.grid, scene.has_view_disparity)
        if found is None:
            return None
        seen |= found
    return seen
