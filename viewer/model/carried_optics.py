"""Optics that show a newly planned scene as it was seen before."""

from __future__ import annotations

from dataclasses import dataclass, replace

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.lens_limits import aperture_limit, clamp_eye
from iibr_core.scenes.scene import Scene
from iibr_core.types import ViewOffset
from viewer.model.focal_plane import focus_on, sharp_disparity

SHARP_SHARE = 0.05
"""Distance from the focus up to which a place counts as sharp, as a share of the range of disparity."""


@dataclass(frozen=True)
class NewDepth:
    """The open photo has new depth. in_focus: disparity before and now of the place that was clicked to be sharp."""

    in_focus: tuple[float, float] | None = None


def carry_optics(optics: Optics, old: Scene | None, new: Scene, limits_aperture: bool = True) -> Optics:
    """Return the optics that show a newly planned scene as it was seen before; the usual optics for a new scene.

    limits_aperture: whether the aperture ends at the widest of the new grid. Optics that are kept for undo are not
    limited: they may return to a plan like the first.
    """
    if old is None or old.source is not new.source:  # a file opened again is new
        return Optics()
    eye = ViewOffset(*(x * _steps(b) / _steps(a) for x, a, b in zip(optics.eye, old.grid, new.grid)))
    columns = _steps(new.grid.columns) / _steps(old.grid.columns)
    if old.plan is None or new.plan is None:
        ratio, shift = 1 / columns, 0.0  # a light field: the same rays in other steps
    else:
        ratio = new.plan.disparity_scale / old.plan.disparity_scale if old.plan.disparity_scale else 0.0
        # (given - zero) * scale, for the given disparity that was in focus
        shift = (old.plan.disparity_zero - new.plan.disparity_zero) * new.plan.disparity_scale
    # discs stay as wide as they are
    aperture = optics.aperture_diameter / abs(ratio) if ratio else optics.aperture_diameter
    if limits_aperture:
        aperture = min(aperture, aperture_limit(new))
    return replace(
        optics.with_focus_scaled(ratio),
        eye=clamp_eye(eye, new.grid),
        dolly=optics.dolly * columns,
        focus_disparity=optics.focus_disparity * ratio + shift,
        aperture_diameter=aperture,
    )


def carry_to_depth(
    optics: Optics,
    old: Scene,
    new: Scene,
    new_depth: NewDepth,
    focused_at: tuple[float, float] | None,
    limits_aperture: bool = True,
) -> Optics:
    """Return the optics that show a photo with new depth as it was seen before.

    A place that was clicked stays sharp; any other focus keeps its share of the range from far to near.
    """
    (far, near), (far_now, near_now) = old.disparity_range_px, new.disparity_range_px
    ratio = (near_now - far_now) / (near - far) if near > far else 1.0
    # nobody chose a focus of 0: it is the plan's and stays 0
    focus = far_now + (optics.focus_disparity - far) * ratio if optics.focus_disparity else 0.0
    carried = with_focus_of(carry_optics(optics, old, new, limits_aperture), optics.with_focus_scaled(ratio))
    carried = replace(carried, focus_disparity=focus)
    if new_depth.in_focus is None or focused_at is None:
        return carried
    before, now = new_depth.in_focus
    is_sharp_there = abs(sharp_disparity(optics, focused_at) - before) <= SHARP_SHARE * (near - far)
    return focus_on(carried, focused_at, now) if is_sharp_there else carried


def with_focus_of(optics: Optics, other: Optics) -> Optics:
    """Return the optics with the plane of focus of `other`."""
    disparity, range_, tilt = other.focus_disparity, other.focus_range, other.focus_tilt
    return replace(optics, focus_disparity=disparity, focus_range=range_, focus_tilt=tilt)


def _steps(views: int) -> int:
    return max(views - 1, 1)
