"""What each action on the depth does to the state. Values that are not finite change nothing, others are clamped."""

from __future__ import annotations

from dataclasses import replace
from math import hypot, isfinite

from iibr_core.depth.editing.edits import (
    DEPTH_TOOLS,
    GAMMA_LIMITS,
    MAX_POINTS,
    RADIUS_LIMITS,
    UNEDITED,
    DepthEdits,
    Stroke,
)
from iibr_core.scenes.lens_limits import clamp
from iibr_core.scenes.scene import DepthSettings
from viewer.model.history import record_edit
from viewer.model.messages import notify
from viewer.model.state.app_state import AppState
from viewer.model.state.depth_editing import (
    Brush,
    DepthAction,
    DropStroke,
    Paint,
    PickDepth,
    ResetDepth,
    SetBrush,
    SetRefine,
    SetTone,
)
from viewer.model.state.notices import Notice
from viewer.model.state.preferences import with_sections

POINT_SPACING = 1 / 6
"""Of the radius: a stroke is remembered by places this far apart."""
LEAST_CLIP_GAP = 0.01
NO_DEPTH_HERE = "The depth of a light field read from disk cannot be edited; open a photo."


def reduce_depth(state: AppState, action: DepthAction) -> AppState:
    """The state after an action on the depth."""
    if state.scene is None or state.source is None:
        return state
    if state.scene.plan is None:
        return notify(state, Notice(NO_DEPTH_HERE)) if isinstance(action, SetBrush) and action.brush.is_on else state
    match action:
        case SetRefine(is_on):
            return _with_settings(state, replace(state.depth, refine=is_on), "SetRefine", is_finished=True)
        case SetTone(tone, is_finished) if all(map(isfinite, (tone.far_clip, tone.near_clip, tone.gamma))):
            edits = replace(_clamp_tone(tone, state.depth.edits), strokes=state.depth.edits.strokes)
            return _with_settings(state, replace(state.depth, edits=edits), "SetTone", is_finished)
        case SetBrush(brush) if isfinite(brush.radius) and isfinite(brush.strength):
            gloss_brush = replace(state.gloss_brush, is_on=state.gloss_brush.is_on and not brush.is_on)
            taken = replace(state, brush=_clamp_brush(brush), gloss_brush=gloss_brush)
            return _with_depth_section(taken) if brush.is_on and not state.brush.is_on else taken
        case Paint(place) if all(map(isfinite, place)):
            return _paint(state, place)
        case PickDepth(sample) if all(map(isfinite, (*sample.place, sample.disparity))):
            tool = state.brush.tool if state.brush.tool in DEPTH_TOOLS else "level"
            return replace(state, brush=replace(state.brush, tool=tool, sample=sample))
        case DropStroke() if state.stroke is not None:
            # the worker was stopped when the stroke began
            return replace(state, stroke=None, generation=state.generation + 1)
        case ResetDepth():
            return _with_settings(state, DepthSettings(state.scene.source.depth.refine), "ResetDepth", is_finished=True)
    return state


def end_stroke(state: AppState) -> AppState:
    """The pointer went up: the stroke under way is one of the edits now."""
    if state.stroke is None:
        return state
    return _with_settings(replace(state, stroke=None), current_depth_settings(state), "Paint", is_finished=True)


def current_depth_settings(state: AppState) -> DepthSettings:
    """What is to be made of the depth of the open scene, the stroke under way included."""
    if state.stroke is None:
        return state.depth
    edits = state.depth.edits
    return replace(state.depth, edits=replace(edits, strokes=(*edits.strokes, state.stroke)))


def depth_settings_for_worker(state: AppState) -> DepthSettings:
    """What the worker is to make of the depth. Where another scene is asked for, it begins with its own."""
    source, scene = state.source, state.scene
    is_open = source is None or (scene is not None and scene.source is source)
    return state.depth if source is None or is_open else DepthSettings(source.depth.refine)


def is_depth_ahead(state: AppState, asked_for: DepthSettings) -> bool:
    """Whether the depth of the open scene is being edited: it is not what the worker was asked for."""
    is_open = state.scene is not None and state.scene.source is state.source
    return is_open and current_depth_settings(state) != asked_for


def _with_depth_section(state: AppState) -> AppState:
    """Who takes the brush by its key sees what it is and can do."""
    sections = with_sections(state.preferences.open_sections, "depth")
    return replace(state, preferences=replace(state.preferences, open_sections=sections))


def _with_settings(state: AppState, depth_settings: DepthSettings, kind: str, is_finished: bool) -> AppState:
    generation = state.generation + 1 if is_finished else state.generation
    after = replace(state, depth=depth_settings, generation=generation)
    return record_edit(state, after, kind)


def _paint(state: AppState, place: tuple[float, float]) -> AppState:
    scene, stroke, brush = state.scene, state.stroke, state.brush
    assert scene is not None
    if stroke is None:
        is_whole = brush.tool in DEPTH_TOOLS  # half the way to a depth would be no depth that anybody chose
        taken_from = brush.sample.place if brush.sample is not None and is_whole else None
        stroke = Stroke(brush.tool, (place,), brush.radius, 1.0 if is_whole else brush.strength, taken_from)
        return replace(state, stroke=stroke)
    last = stroke.points[-1]
    step = hypot(place[0] - last[0], (place[1] - last[1]) * scene.height / scene.width)
    if step < POINT_SPACING * stroke.radius or len(stroke.points) >= MAX_POINTS:
        return state
    return replace(state, stroke=replace(stroke, points=(*stroke.points, place)))


def _clamp_tone(tone: DepthEdits, before: DepthEdits) -> DepthEdits:
    """Gamma and clips within their limits; the clip that was moved gives way to the other."""
    far, near = clamp(tone.far_clip, 0.0, 1.0), clamp(tone.near_clip, 0.0, 1.0)
    if far > near - LEAST_CLIP_GAP and far != before.far_clip:
        far = max(near - LEAST_CLIP_GAP, 0.0)
    if near < far + LEAST_CLIP_GAP:
        near = min(far + LEAST_CLIP_GAP, 1.0)
    return replace(
        UNEDITED, is_inverted=tone.is_inverted, far_clip=far, near_clip=near, gamma=clamp(tone.gamma, *GAMMA_LIMITS)
    )


def _clamp_brush(brush: Brush) -> Brush:
    return replace(brush, radius=clamp(brush.radius, *RADIUS_LIMITS), strength=clamp(brush.strength, 0.0, 1.0))
