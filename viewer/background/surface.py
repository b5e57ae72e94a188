"""The surface under a place that was clicked, found in a thread."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from iibr_core.depth.editing.edits import extent_of
from iibr_core.method.plan import ScenePlan
from iibr_core.scenes.scene import LoadedPhoto
from viewer.background.newest import Post
from viewer.model.selection import surface_stroke

RANGE_PERCENTILES = 5.0, 95.0
"""Percentiles of the disparity of a surface that count as its far and near end."""


@dataclass(frozen=True, eq=False)
class SurfaceRequest:
    """A place in a photo, (x, y) as shares of its size, and the tolerance of the flood; see `Stroke`."""

    place: tuple[float, float]
    tolerance: float
    loaded: LoadedPhoto
    plan: ScenePlan


@dataclass(frozen=True, eq=False)
class Surface:
    """The surface at a place. mask: (H, W), 255 where it is. range_px: (far, near) disparity in px per view step."""

    place: tuple[float, float]
    mask: NDArray[np.uint8]
    range_px: tuple[float, float]


def find_surface(request: SurfaceRequest, post: Post[Surface]) -> None:
    """Post the surface, as the bucket would fill it."""
    from iibr_core.depth.editing.bucket import surface_at

    loaded, plan = request.loaded, request.plan
    values = loaded.disparity.values
    stroke = surface_stroke("fill", request.place, request.tolerance)
    mask = surface_at(loaded.photo.pixels, values, stroke, 0, extent_of(values))
    far, near = np.percentile(values[mask], RANGE_PERCENTILES) if mask.any() else (0.0, 0.0)
    ends = (float(end - plan.disparity_zero) * plan.disparity_scale for end in (far, near))
    post(Surface(request.place, mask * np.uint8(255), (next(ends), next(ends))))
