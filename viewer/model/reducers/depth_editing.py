"""What each action on the depth does to the state. Values that are not finite change nothing, others are clamped."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, isfinite

from iibr_core.depth.editing.edits import GAMMA_LIMITS, MOST_POINTS, RADIUS_LIMITS, UNEDITED, DepthEdits, Stroke
from viewer.model.lens.limits import clamped
from viewer.model.reducers.history import recorded
from viewer.model.reducers.worker_events import noticed
from viewer.model.state.app_state import AppState, Notice
from viewer.model.state.depth_editing import (
    Brush,
    DepthEdit,
    DepthWork,
    DropStroke,
    Paint,
    ResetDepth,
    SetBrush,
    SetRefine,
    SetTone,
)

POINT_SPACING = 1 / 6
"""Of the radius: a stroke is remembered by places this far apart."""
LEAST_CLIP_GAP = 0.01
NO_DEPTH_HERE = "The depth of a light field read from disk cannot be edited; open a photo."


def depth_edited(state: AppState, action: DepthEdit) -> AppState:
    """The state after an action on the depth."""
    if state.scene is None or state.source is None:
        return state
    if state.scene.plan is None:
        return noticed(state, Notice(NO_DEPTH_HERE)) if isinstance(action, SetBrush) and action.brush.is_on else state
    match action:
        case SetRefine(strength, is_finished) if isfinite(strength):
            work = replace(state.depth, refine=clamped(strength, 0.0, 1.0))
            return _worked(state, work, "SetRefine", is_finished)
        case SetTone(tone, is_finished) if all(map(isfinite, (tone.far_clip, tone.near_clip, tone.gamma))):
            edits = replace(_clamped_tone(tone, state.depth.edits), strokes=state.depth.edits.strokes)
            return _worked(state, replace(state.depth, edits=edits), "SetTone", is_finished)
        case SetBrush(brush) if isfinite(brush.radius) and isfinite(brush.strength):
            return replace(state, brush=_clamped_brush(brush))
        case Paint(place) if all(map(isfinite, place)):
            return _painted(state, place)
        case DropStroke() if state.stroke is not None:
            # the worker was stopped when the stroke began
            return replace(state, stroke=None, generation=state.generation + 1)
        case ResetDepth():
            return _worked(state, DepthWork(state.scene.source.refine), "ResetDepth", is_finished=True)
    return state


def stroke_ended(state: AppState) -> AppState:
    """The pointer went up: the stroke under way is one of the edits now."""
    if state.stroke is None:
        return state
    edits = state.depth.edits
    work = replace(state.depth, edits=replace(edits, strokes=(*edits.strokes, state.stroke)))
    return _worked(replace(state, stroke=None), work, "Paint", is_finished=True)


def wanted_work(state: AppState) -> DepthWork:
    """What is to be made of the depth of the open scene, the stroke under way included."""
    if state.stroke is None:
        return state.depth
    edits = state.depth.edits
    return replace(state.depth, edits=replace(edits, strokes=(*edits.strokes, state.stroke)))


def work_asked_for(state: AppState) -> DepthWork:
    """What the worker is to make of the depth. Where another scene is asked for, it begins with its own."""
    source, scene = state.source, state.scene
    is_open = source is None or (scene is not None and scene.source is source)
    return state.depth if source is None or is_open else DepthWork(source.refine)


def is_depth_ahead(state: AppState, asked_for: DepthWork) -> bool:
    """Whether the depth of the open scene is being edited: it is not what the worker was asked for."""
    is_open = state.scene is not None and state.scene.source is state.source
    return is_open and wanted_work(state) != asked_for


def _worked(state: AppState, work: DepthWork, kind: str, is_finished: bool) -> AppState:
    after = replace(state, depth=work, generation=state.generation + is_finished)
    return recorded(state, after, kind)


def _painted(state: AppState, place: tuple[float, float]) -> AppState:
    scene, stroke, brush = state.scene, state.stroke, state.brush
    assert scene is not None
    if stroke is None:
        return replace(state, stroke=Stroke(brush.tool, (place,), brush.radius, brush.strength))
    last = stroke.points[-1]
    step = hypot(place[0] - last[0], (place[1] - last[1]) * scene.height / scene.width)
    if step < POINT_SPACING * stroke.radius or len(stroke.points) >= MOST_POINTS:
        return state
    return replace(state, stroke=replace(stroke, points=(*stroke.points, place)))


def _clamped_tone(tone: DepthEdits, before: DepthEdits) -> DepthEdits:
    """Gamma and clips within their limits; the clip that was moved gives way to the other."""
    far, near = clamped(tone.far_clip, 0.0, 1.0), clamped(tone.near_clip, 0.0, 1.0)
    if far > near - LEAST_CLIP_GAP and far != before.far_clip:
        far = max(near - LEAST_CLIP_GAP, 0.0)
    if near < far + LEAST_CLIP_GAP:
        near = min(far + LEAST_CLIP_GAP, 1.0)
    return replace(
        UNEDITED, is_inverted=tone.is_inverted, far_clip=far, near_clip=near, gamma=clamped(tone.gamma, *GAMMA_LIMITS)
    )


def _clamped_brush(brush: Brush) -> Brush:
    return replace(brush, radius=clamped(brush.radius, *RADIUS_LIMITS), strength=clamped(brush.strength, 0.0, 1.0))
