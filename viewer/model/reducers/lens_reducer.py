"""What each edit makes of the optics. Values that are not finite change nothing, others are clamped to the scene."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise
from math import hypot
from typing import Any

from iibr_core.beyond.optics import Optics
from iibr_core.gloss.settings import MAX_STROKE_POINTS, Gloss, GlossStroke
from iibr_core.scenes.lens_limits import (
    aperture_limit,
    clamp,
    clamp_eye,
    clamp_optics,
    first_aperture,
    is_finite,
)
from iibr_core.scenes.scene import Scene
from iibr_core.types import ViewOffset
from viewer.model.actions import SamePlaces
from viewer.model.lens.focal_plane import focus_on, sharp_disparity, tilt_through
from viewer.model.lens.presets import preset_optics
from viewer.model.state.app_state import AppState, TiltHandles
from viewer.model.state.optics_actions import (
    ApplyPreset,
    FocusOn,
    GlossBrush,
    LensAction,
    MoveEye,
    MoveTiltHandle,
    PaintGloss,
    ResetOptics,
    SetAperture,
    SetFocus,
    SetOptics,
)

POINT_SPACING = 1 / 6
"""Distance between the points of a gloss stroke, as a share of its radius."""
SHARP_SHARE = 0.05
"""Of the range of disparity: a place as near to the focus was made sharp by the click on it."""


def reduce_lens(state: AppState, action: LensAction) -> AppState:
    """The state with edited optics; the same state where no scene is open or a value is not finite."""
    scene = state.scene
    if scene is None:
        return state
    if isinstance(action, MoveTiltHandle):
        return _move_handle(state, scene, action)
    optics = _edit_optics(state, scene, action)
    if not is_finite(optics):
        return state
    edited = replace(_note_choice(state, action), optics=clamp_optics(optics, scene))
    return _open_for_focus(edited, scene) if isinstance(action, FocusOn | SetFocus) else edited


def _note_choice(state: AppState, action: LensAction) -> AppState:
    """Remember what the user has decided about focus and aperture. Where the tilt goes, its handles do too."""
    match action:
        case FocusOn(place):
            return replace(state, has_chosen_focus=True, focused_at=place)
        case SetFocus():
            return replace(state, has_chosen_focus=True, focused_at=None)
        case SetAperture():
            return replace(state, has_chosen_aperture=True)
        case ApplyPreset():
            return replace(state, has_chosen_aperture=True, has_chosen_focus=False, tilt_handles=None)
        case ResetOptics():
            return replace(state, has_chosen_aperture=False, has_chosen_focus=False, tilt_handles=None)
    return state


def _open_for_focus(state: AppState, scene: Scene) -> AppState:
    """A pinhole shows everything sharp: the first focusing opens it a little, unless the user chose it."""
    diameter = first_aperture(scene)
    if state.has_chosen_aperture or state.optics.aperture_diameter > 0 or diameter == 0:
        return state
    return replace(state, optics=replace(state.optics, aperture_diameter=diameter))


def _edit_optics(state: AppState, scene: Scene, action: LensAction) -> Optics:
    optics = state.optics
    match action:
        case MoveEye(eye):
            return replace(optics, eye=eye)
        case SetOptics(field, value):
            change: dict[str, Any] = {field: value}
            return replace(optics, **change)
        case SetFocus(disparity):
            return replace(optics, focus_disparity=disparity)
        case FocusOn(place, disparity):
            return focus_on(optics, place, disparity)
        case SetAperture(diameter):
            return replace(optics, aperture_diameter=diameter)
        case PaintGloss(place, brush, begins) if optics.gloss is not None:
            return replace(optics, gloss=_painted(optics.gloss, place, brush, begins, scene))
        case ApplyPreset(name):
            return preset_optics(name, optics, scene, state.has_chosen_focus)
        case ResetOptics():
            return Optics(gloss=optics.gloss)
    return optics


def _painted(gloss: Gloss, place: tuple[float, float], brush: GlossBrush, begins: bool, scene: Scene) -> Gloss:
    """Return the gloss with a new stroke, or with a new point of the last stroke."""
    strokes = gloss.surface.strokes
    place = clamp(place[0], -1.0, 2.0), clamp(place[1], -1.0, 2.0)
    stroke = GlossStroke((place,), brush.radius, brush.erases)
    if strokes and not begins:
        last = strokes[-1]
        step = hypot(place[0] - last.points[-1][0], (place[1] - last.points[-1][1]) * scene.height / scene.width)
        if step < POINT_SPACING * last.radius or len(last.points) >= MAX_STROKE_POINTS:
            return gloss
        strokes, stroke = strokes[:-1], replace(last, points=(*last.points, place))
    return replace(gloss, surface=replace(gloss.surface, strokes=(*strokes, stroke)))


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
    aperture = min(optics.aperture_diameter * _steps(new.grid[0]) / _steps(old.grid[0]), aperture_limit(new.grid))
    return replace(
        optics.with_focus_scaled(ratio),
        eye=clamp_eye(eye, new.grid),
        dolly=optics.dolly * columns,
        focus_disparity=optics.focus_disparity * ratio + shift,
        aperture_diameter=aperture,
    )


def carry_to_depth(
    optics: Optics, old: Scene, new: Scene, same: SamePlaces, focused_at: tuple[float, float] | None
) -> Optics:
    """The optics that show a photo whose depth was found again as it was seen before: what was sharp stays sharp."""
    (first, first_now), (last, last_now) = same.pairs[0], same.pairs[-1]
    ratio = abs(last_now - first_now) / (last - first) if last > first else 1.0
    # nobody chose a focus of 0: it is the plan's own, and stays that
    focus = _disparity_now(optics.focus_disparity, same.pairs) if optics.focus_disparity else 0.0
    carried = with_focus_of(carry_optics(optics, old, new), optics.with_focus_scaled(ratio))
    carried = replace(carried, focus_disparity=focus)
    if same.in_focus is None or focused_at is None:
        return carried
    before, now = same.in_focus
    is_sharp_there = abs(sharp_disparity(optics, focused_at) - before) <= SHARP_SHARE * (last - first)
    return focus_on(carried, focused_at, now) if is_sharp_there else carried


def with_focus_of(optics: Optics, other: Optics) -> Optics:
    """The optics with the plane of focus of others."""
    disparity, range_, tilt = other.focus_disparity, other.focus_range, other.focus_tilt
    return replace(optics, focus_disparity=disparity, focus_range=range_, focus_tilt=tilt)


def _disparity_now(disparity: float, pairs: tuple[tuple[float, float], ...]) -> float:
    """What places of this disparity have now, between those that are known."""
    for (low, low_now), (high, high_now) in pairwise(pairs):
        if disparity <= high:
            share = clamp((disparity - low) / (high - low), 0.0, 1.0) if high > low else 0.0
            return low_now + share * (high_now - low_now)
    return pairs[-1][1]


def _steps(views: int) -> int:
    return max(views - 1, 1)
