"""Editing of depth: records, verbs, and what follows from the state."""

from __future__ import annotations

from dataclasses import dataclass, replace
from math import isfinite
from typing import TYPE_CHECKING, Literal

from iibr_core.depth.editing.edits import (
    BRUSH_TOOLS,
    DEPTH_TOOLS,
    FEATHER_LIMITS,
    GAMMA_LIMITS,
    MAX_POINTS,
    RADIUS_LIMITS,
    TOLERANCE_LIMITS,
    UNEDITED,
    BrushTool,
    DepthEdits,
    Stroke,
)
from iibr_core.scenes.lens_limits import clamp
from iibr_core.scenes.scene import DepthSettings, Scene
from viewer.model.history import record_edit, undoable
from viewer.model.inspection import set_overlay
from viewer.model.messages import Notice, notify
from viewer.model.preferences import with_sections
from viewer.model.stroke_path import longer_path

if TYPE_CHECKING:
    from viewer.model.app_state import AppState


Tool = BrushTool | Literal["select"]
TOOLS: tuple[Tool, ...] = (*BRUSH_TOOLS, "select")
"""Tools for the picture: they paint, or select a surface."""


@dataclass(frozen=True)
class DepthSample:
    """A place whose depth was picked, (x, y) as shares of the photo's width and height, and the disparity there."""

    place: tuple[float, float]
    disparity: float


@dataclass(frozen=True)
class Brush:
    """The tool for the picture while it is on. radius, strength, tolerance, feather: see `Stroke`.

    sample: source of the depth that "level" and "fill" paint, None: the beginning of the stroke. brought_overlay:
    whether the depth overlay came with the brush, and goes with it.
    """

    tool: Tool = "nearer"
    radius: float = 0.03
    strength: float = 0.25
    tolerance: float = 1.0
    feather: float = 0.0
    is_on: bool = False
    sample: DepthSample | None = None
    brought_overlay: bool = False


MIN_CLIP_GAP = 0.01
NO_DEPTH_HERE = "The depth of a light field from disk cannot be edited. Open a photo."


@undoable
def set_refine(state: AppState, scene: Scene, is_on: bool) -> AppState:
    """Move depth edges to the photo's edges, or leave them as they are."""
    return _with_settings(state, replace(state.depth, refine=is_on)) if _is_editable(state) else state


@undoable
def set_tone(state: AppState, scene: Scene, tone: DepthEdits, is_finished: bool) -> AppState:
    """Invert, clip and bend the disparity; strokes of `tone` do not count. Only the preview shows unfinished edits."""
    if not _is_editable(state):
        return state
    edits = replace(_clamp_tone(tone, state.depth.edits), strokes=state.depth.edits.strokes)
    return _with_settings(state, replace(state.depth, edits=edits), is_finished)


@undoable
def reset(state: AppState, scene: Scene) -> AppState:
    """Go back to the depth that was found."""
    return _with_settings(state, DepthSettings(scene.source.depth.refine)) if _is_editable(state) else state


def set_brush(state: AppState, brush: Brush) -> AppState:
    """Take this brush or put it away. Taking it opens the section with its settings."""
    if not _is_editable(state):
        is_refused = brush.is_on and state.scene is not None
        return notify(state, Notice(NO_DEPTH_HERE)) if is_refused else state
    gloss_brush = replace(state.gloss_brush, is_on=state.gloss_brush.is_on and not brush.is_on)
    is_selecting = brush.is_on and brush.tool == "select"
    taken = replace(state, gloss_brush=gloss_brush, selection=state.selection if is_selecting else None)
    if brush.is_on and not state.brush.is_on:
        sections = with_sections(state.preferences.open_sections, "depth")
        taken = replace(taken, preferences=replace(state.preferences, open_sections=sections))
    return _with_brush_overlay(taken, _clamp_brush(brush))


def _with_brush_overlay(state: AppState, brush: Brush) -> AppState:
    """Return the state with this brush. A brush that paints brings the depth overlay, and takes it away again."""
    overlay = state.inspection.overlay
    paints, painted = (tool.is_on and tool.tool != "select" for tool in (brush, state.brush))
    if paints and not painted and overlay is None:
        return set_overlay(replace(state, brush=replace(brush, brought_overlay=True)), "disparity")
    state = replace(state, brush=brush if paints else replace(brush, brought_overlay=False))
    return set_overlay(state, None) if painted and not paints and brush.brought_overlay else state


def paint(state: AppState, place: tuple[float, float]) -> AppState:
    """Begin or continue a stroke at a place, (x, y) as shares of the photo's width and height."""
    if state.scene is None or not _is_editable(state):
        return state
    if state.stroke is None:
        stroke = _first_stroke(state.brush, place)
        return state if stroke is None else replace(state, stroke=stroke)
    stroke = state.stroke
    points = longer_path(stroke.points, place, stroke.radius, state.scene.size, MAX_POINTS)
    return state if points is stroke.points else replace(state, stroke=replace(stroke, points=points))


def pick(state: AppState, sample: DepthSample) -> AppState:
    """Let the brush paint the depth of this place."""
    if not (_is_editable(state) and all(map(isfinite, (*sample.place, sample.disparity)))):
        return state
    tool = state.brush.tool if state.brush.tool in DEPTH_TOOLS else "level"
    return replace(state, brush=replace(state.brush, tool=tool, sample=sample))


def drop_stroke(state: AppState) -> AppState:
    """Take the unfinished stroke back and let the worker continue."""
    return state if state.stroke is None else replace(state, stroke=None, generation=state.generation + 1)


def end_stroke(state: AppState) -> AppState:
    """Add the unfinished stroke to the edits."""
    if state.stroke is None:
        return state
    return record_edit(state, _with_settings(replace(state, stroke=None), current_settings(state)), "paint")


def current_settings(state: AppState) -> DepthSettings:
    """Return the settings of the open scene, with the unfinished stroke."""
    if state.stroke is None:
        return state.depth
    edits = state.depth.edits
    return replace(state.depth, edits=replace(edits, strokes=(*edits.strokes, state.stroke)))


def settings_for_worker(state: AppState) -> DepthSettings:
    """Return the settings of the scene that was asked for last; a scene that is not open yet has none of its own."""
    source, scene = state.source, state.scene
    is_open = source is None or (scene is not None and scene.source is source)
    return state.depth if source is None or is_open else DepthSettings(source.depth.refine)


def is_ahead(state: AppState, asked_for: DepthSettings) -> bool:
    """Return whether the depth of the open scene was edited since the worker was asked for it."""
    is_open = state.scene is not None and state.scene.source is state.source
    return is_open and current_settings(state) != asked_for


def _is_editable(state: AppState) -> bool:
    return state.source is not None and state.scene is not None and state.scene.plan is not None


def _with_settings(state: AppState, settings: DepthSettings, is_finished: bool = True) -> AppState:
    return replace(state, depth=settings, generation=state.generation + 1 if is_finished else state.generation)


def _first_stroke(brush: Brush, place: tuple[float, float]) -> Stroke | None:
    """Return a new stroke, None if the tool does not paint; tools that paint one depth paint it whole."""
    if brush.tool == "select":
        return None
    is_whole = brush.tool in DEPTH_TOOLS
    taken_from = brush.sample.place if brush.sample is not None and is_whole else None
    strength = 1.0 if is_whole else brush.strength
    return Stroke(brush.tool, (place,), brush.radius, strength, taken_from, brush.tolerance)


def _clamp_brush(brush: Brush) -> Brush:
    return replace(
        brush,
        radius=clamp(brush.radius, *RADIUS_LIMITS),
        strength=clamp(brush.strength, 0.0, 1.0),
        tolerance=clamp(brush.tolerance, *TOLERANCE_LIMITS),
        feather=clamp(brush.feather, *FEATHER_LIMITS),
    )


def _clamp_tone(tone: DepthEdits, before: DepthEdits) -> DepthEdits:
    """Return gamma and clips within their limits; the clip that was not moved gives way."""
    far, near = clamp(tone.far_clip, 0.0, 1.0), clamp(tone.near_clip, 0.0, 1.0)
    if far > near - MIN_CLIP_GAP and far != before.far_clip:
        far = max(near - MIN_CLIP_GAP, 0.0)
    if near < far + MIN_CLIP_GAP:
        near = min(far + MIN_CLIP_GAP, 1.0)
    gamma = clamp(tone.gamma, *GAMMA_LIMITS)
    return replace(UNEDITED, is_inverted=tone.is_inverted, far_clip=far, near_clip=near, gamma=gamma)
