"""Limits of the lens for a scene; sliders and clamps take their ends from here."""

import math
from dataclasses import fields, replace
from typing import Any, TypeVar

from iibr_core.beyond.optics import LIMITS, ApertureShape, Optics
from iibr_core.scenes.scene import Scene
from iibr_core.types import GridShape, ViewOffset

Record = TypeVar("Record", Optics, ApertureShape)

LONE_VIEW_MARGIN = 0.5
"""Largest distance of the viewpoint from a single row of views, in view steps."""
WIDEST_DISC = 0.15
"""Diameter of the widest disc as a share of the picture's width."""
FIRST_DISC = 0.03
"""Widest disc, as a share of the picture's width, of the aperture that focusing opens: enough to see its effect."""
BLADES_LIMITS = (3, 11)
STEEPEST_TILT = 4.0
"""Steepest tilt from the picture's middle to its border, in spans of the focus: for tilt handles close together."""


def clamp(value: float, low: float, high: float) -> float:
    """Return the nearest value from low to high; low for a value that is not a number."""
    return float(min(max(low, value), high))


def eye_limits(views: int) -> tuple[float, float]:
    """Return the least and greatest view offset along a row of views.

    The viewpoint leaves a single view a little, because it could not move otherwise; the view is stretched there.
    """
    margin = LONE_VIEW_MARGIN if views == 1 else 0.0
    return -(views // 2) - margin, views - 1 - views // 2 + margin


def clamp_eye(eye: ViewOffset, grid: GridShape) -> ViewOffset:
    """Return the nearest viewpoint within the limits."""
    return ViewOffset(*(clamp(x, *eye_limits(views)) for x, views in zip(eye, grid)))


def clamp_to_grid(eye: ViewOffset, grid: GridShape) -> ViewOffset:
    """Return the point of the grid's rectangle nearest to the eye."""
    first, last = grid.offset(0, 0), grid.offset(grid.rows - 1, grid.columns - 1)
    return ViewOffset(*map(clamp, eye, first, last))


def dolly_limit(grid: GridShape) -> float:
    """Return how far forward or back the rays of the picture's borders still cross the stored views."""
    return (grid.columns - 1) / 2


def focus_limits(scene: Scene) -> tuple[float, float]:
    """Return the least and greatest focus disparity: the scene's range and a tenth more on both sides."""
    near_and_far = (*scene.disparity_range_px, 0.0)
    margin = 0.1 * (max(near_and_far) - min(near_and_far)) or 0.1
    return min(near_and_far) - margin, max(near_and_far) + margin


def focus_span(scene: Scene) -> float:
    """Return the range from the least focus disparity to the greatest: the limit of focus range and tilt."""
    low, high = focus_limits(scene)
    return high - low


def aperture_limit(scene: Scene) -> float:
    """Return the widest aperture in view steps; 0 for a single view.

    Focused on the middle of the scene's disparities, it blurs the nearest and the farthest by discs of WIDEST_DISC.
    Views without disparity allow as much as their grid.
    """
    grid = float(max(scene.grid) if max(scene.grid) > 1 else 0)
    return max(grid, aperture_of_disc(scene, 2 * WIDEST_DISC))


def aperture_of_disc(scene: Scene, share: float) -> float:
    """Return the aperture in view steps whose widest disc, focused on the nearest, is this share of the width.

    Views without disparity know no discs: their widest one counts as that of the whole grid. 0 for a single view.
    """
    far, near = scene.disparity_range_px
    if max(scene.grid) == 1:
        return 0.0
    if not scene.has_view_disparity or near <= far:
        return float(max(scene.grid)) * share / (2 * WIDEST_DISC)
    return share * scene.width / (near - far)


def is_finite(optics: Optics) -> bool:
    """Return whether every number of the optics is finite."""
    return all(map(math.isfinite, (*_numbers_of(optics), *_numbers_of(optics.aperture_shape))))


def _numbers_of(record: Optics | ApertureShape) -> list[float]:
    values = (getattr(record, field.name) for field in fields(record))
    parts = (value if isinstance(value, tuple) else (value,) for value in values)
    return [number for part in parts for number in part if isinstance(number, int | float)]


def clamp_optics(optics: Optics, scene: Scene) -> Optics:
    """Return the nearest optics that this scene allows. All numbers must be finite."""
    span = focus_span(scene)
    tilt_x, tilt_y = (clamp(tilt, -STEEPEST_TILT * span, STEEPEST_TILT * span) for tilt in optics.focus_tilt)
    return replace(
        _within_limits(optics),
        eye=clamp_eye(optics.eye, scene.grid),
        dolly=clamp(optics.dolly, -dolly_limit(scene.grid), dolly_limit(scene.grid)),
        focus_disparity=clamp(optics.focus_disparity, *focus_limits(scene)),
        focus_range=clamp(optics.focus_range, 0.0, span),
        focus_tilt=(tilt_x, tilt_y),
        aperture_diameter=clamp(optics.aperture_diameter, 0.0, aperture_limit(scene)),
        aperture_shape=_clamp_shape(optics.aperture_shape),
    )


def _clamp_shape(shape: ApertureShape) -> ApertureShape:
    return replace(
        _within_limits(shape),
        kind="disc" if shape.kind == "mask" and shape.mask is None else shape.kind,
        blades=round(clamp(shape.blades, *BLADES_LIMITS)),
        rotation_deg=shape.rotation_deg % 360.0 % 360.0,  # the first may round up to 360
    )


def _within_limits(record: Record) -> Record:
    """Clamp every number that states its limits, see `optics.within`."""
    limited = [(field.name, field.metadata[LIMITS]) for field in fields(record) if LIMITS in field.metadata]
    changes: dict[str, Any] = {name: clamp(getattr(record, name), *limits) for name, limits in limited}
    return replace(record, **changes)


def first_aperture(scene: Scene) -> float:
    """Return the aperture, in view steps, to which focusing opens a pinhole; 0 for a single view."""
    return aperture_of_disc(scene, FIRST_DISC)
