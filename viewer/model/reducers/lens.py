"""What each edit makes of the optics. Values that are not finite change nothing, others are clamped to the scene."""

from __future__ import annotations

from dataclasses import replace

from iibr_core.types import ViewOffset
from viewer.model.lens.focal_plane import focus_on, sharp_disparity, tilt_through
from viewer.model.lens.limits import aperture_limit, clamp, clamp_eye, clamp_optics, is_finite
from viewer.model.lens.presets import preset_optics
from viewer.model.state.app_state import AppState, Scene, TiltHandles
from viewer.model.state.optics import (
    ApplyPreset,
    FocusOn,
    LensAction,
    MoveEye,
    MoveTiltHandle,
    Optics,
    ResetOptics,
    SetAperture,
    SetApertureShape,
    SetDolly,
    SetExposure,
    SetFocus,
    SetFocusRange,
    SetHighlightRecovery,
    SetTilt,
)


def reduce_lens(state: AppState, action: LensAction) -> AppState:
    """The state with edited optics; the same state where no scene is open or a value is not finite."""
    if state.scene is None:
        return state
    optics = _edit_optics(state.optics, state.scene, action)
    if isinstance(action, MoveTiltHandle):
        return _move_handle(state, state.scene, action)
    return replace(state, optics=clamp_optics(optics, state.scene)) if is_finite(optics) else state


def _edit_optics(optics: Optics, scene: Scene, action: LensAction) -> Optics:
    match action:
        case MoveEye(eye):
            return replace(optics, eye=eye)
        case SetDolly(dolly):
            return replace(optics, dolly=dolly)
        case SetFocus(disparity):
            return replace(optics, focus_disparity=disparity)
        case FocusOn(place, disparity):
            return focus_on(optics, place, disparity)
        case SetFocusRange(disparity):
            return replace(optics, focus_range=disparity)
        case SetTilt(tilt):
            return replace(optics, focus_tilt=tilt)
        case SetAperture(diameter):
            return replace(optics, aperture_diameter=diameter)
        case SetApertureShape(shape):
            return replace(optics, aperture_shape=shape)
        case SetHighlightRecovery(amount):
            return replace(optics, highlight_recovery=amount)
        case SetExposure(stops):
            return replace(optics, exposure_stops=stops)
        case ApplyPreset(name):
            return preset_optics(name, optics, scene)
        case ResetOptics():
            return Optics()
    return optics


def _move_handle(state: AppState, scene: Scene, action: MoveTiltHandle) -> AppState:
    """The handle goes where the pointer is, and the plane of focus runs through what lies there."""
    handles = state.tilt_handles or TiltHandles()
    x, y = (clamp(value, -1.0, 1.0) for value in action.place)
    old, kept = (handles.first, handles.second) if action.index == 0 else (handles.second, handles.first)
    disparity = sharp_disparity(state.optics, old) if action.disparity is None else action.disparity
    optics = tilt_through(state.optics, (x, y), disparity, kept, scene.height / scene.width)
    if not is_finite(optics):
        return state
    first, second = ((x, y), kept) if action.index == 0 else (kept, (x, y))
    moved = TiltHandles(first, second, taken=action.index)
    return replace(state, optics=clamp_optics(optics, scene), tilt_handles=moved)


def carry_optics(optics: Optics, old: Scene | None, new: Scene) -> Optics:
    """The optics that show a newly planned scene as it was seen before; a scene not seen before starts afresh."""
    if old is None or old.source is not new.source or old.plan is None or new.plan is None:
        return Optics()
    eye = ViewOffset(*(x * _steps(b) / _steps(a) for x, a, b in zip(optics.eye, old.grid, new.grid)))
    columns = _steps(new.grid.columns) / _steps(old.grid.columns)
    ratio = new.plan.disparity_scale / old.plan.disparity_scale if old.plan.disparity_scale else 0.0
    # (given - zero) * scale, for the given disparity that was in focus
    shift = (old.plan.disparity_zero - new.plan.disparity_zero) * new.plan.disparity_scale
    aperture = min(optics.aperture_diameter * _steps(new.grid[0]) / _steps(old.grid[0]), aperture_limit(new.grid))
    return replace(
        optics,
        eye=clamp_eye(eye, new.grid),
        dolly=optics.dolly * columns,
        focus_disparity=optics.focus_disparity * ratio + shift,
        focus_range=optics.focus_range * abs(ratio),
        focus_tilt=(optics.focus_tilt[0] * ratio, optics.focus_tilt[1] * ratio),
        aperture_diameter=aperture,
    )


def _steps(views: int) -> int:
    return max(views - 1, 1)
