"""Disparity and aperture in a photographer's units: relative distance and f-number.

Both need a photo whose focal length is known and whose given disparity is 0 at infinity. The plane that stays still has
the relative distance 1; its distance in metres is not known from one photo, so the f-number assumes one.
"""

from __future__ import annotations

import math

from iibr_core.scenes.f_numbers import disparity_as_given, equivalent_f_number, f_number
from iibr_core.scenes.lens_limits import focus_limits
from iibr_core.scenes.scene import Scene

PROVISIONAL = "f/…"
"""Text of an f-number while the depth that it follows from is not known yet."""
FARTHEST_M = 1000.0
"""Distance from which on a surface counts as infinitely far."""


def relative_distance(scene: Scene, disparity: float) -> float | None:
    """Return the distance of a field disparity, 1 for the plane that stays still; None if unknown or infinite."""
    given = disparity_as_given(scene, disparity)
    still = disparity_as_given(scene, 0.0)
    return still / given if given is not None and still is not None and given > 0 and still > 0 else None


def disparity_at(scene: Scene, distance: float) -> float | None:
    """Return the field disparity of a relative distance, the inverse of `relative_distance`."""
    still = disparity_as_given(scene, 0.0)
    if still is None or scene.plan is None or still <= 0 or distance <= 0:
        return None
    return (still / distance - scene.plan.disparity_zero) * scene.plan.disparity_scale


def distance_limits(scene: Scene) -> tuple[float, float] | None:
    """Return the relative distances of the nearest and the farthest surface, None if one is unknown."""
    far, near = scene.disparity_range_px
    ends = relative_distance(scene, near), relative_distance(scene, far)
    return (ends[0], ends[1]) if ends[0] is not None and ends[1] is not None and ends[0] < ends[1] else None


def f_number_text(scene: Scene, aperture_diameter: float) -> str:
    """Return the aperture as text: "f/2.8", "≈ f/2.8" for an equivalent, "pinhole"; "f/…" while depth is unknown."""
    if aperture_diameter > 0 and (scene.is_sketch or not scene.has_view_disparity):
        return PROVISIONAL
    stop = f_number(scene, aperture_diameter)
    if stop is not None:
        return f"f/{stop:.1f}"
    stop = equivalent_f_number(scene, aperture_diameter)
    return "pinhole" if stop is None else f"≈ f/{stop:.1f}"


def metres(scene: Scene, disparity: float) -> float | None:
    """Return the distance of a field disparity in metres, infinity beyond `FARTHEST_M`, None if unknown."""
    plan = scene.plan
    if scene.inverse_metres is None or plan is None or plan.disparity_scale == 0:
        return None
    slope, offset = scene.inverse_metres
    inverse = slope * (disparity / plan.disparity_scale + plan.disparity_zero) + offset
    return 1 / inverse if inverse > 1 / FARTHEST_M else math.inf


def metres_text(distance_m: float) -> str:
    """Return a distance as text: "0.42 m", "12 m", "∞"."""
    if math.isinf(distance_m):
        return "∞"
    return f"{distance_m:.2f} m" if distance_m < 10 else f"{distance_m:.0f} m"


def far_percent(scene: Scene, disparity: float) -> float:
    """Return the position of a field disparity from 0, the nearest possible focus, to 100, the farthest."""
    low, high = focus_limits(scene)
    return 100 * (high - disparity) / (high - low)
