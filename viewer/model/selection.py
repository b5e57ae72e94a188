"""Verbs about a selected surface: change it by the brush, move it nearer or farther, or keep it sharp."""

from __future__ import annotations

from dataclasses import dataclass, replace

from iibr_core.depth.editing.edits import MAX_PATCHES, MAX_POINTS, BrushTool, Patch, Stroke
from iibr_core.scenes.scene import Scene
from viewer.model import lens
from viewer.model.app_state import AppState
from viewer.model.depth import Brush
from viewer.model.history import record_edit, undoable
from viewer.model.stroke_path import longer_path


@dataclass(frozen=True)
class Selection:
    """A surface that was clicked or painted. place: (x, y) as shares of the photo's width and height.

    patches: see `Stroke`. is_painted: whether only they count, not the surface at the place.
    range_px: (far, near) disparity of the surface, in px per view step; None until the surface was found.
    """

    place: tuple[float, float]
    patches: tuple[Patch, ...] = ()
    is_painted: bool = False
    range_px: tuple[float, float] | None = None


MOVE_SHARE = 0.1
"""Step by which a surface is moved, as a share of the range of depth."""
HOLE_RADIUS = 0.03
"""Radius of the largest hole in a surface that is selected with it, as a share of the photo's width."""

NOWHERE = (-1.0, -1.0)
"""A place outside the photo: no surface is found there."""


def select(state: AppState, place: tuple[float, float]) -> AppState:
    """Select the surface at a place, (x, y) as shares of the photo's width and height."""
    return replace(state, selection=Selection(place))


def deselect(state: AppState) -> AppState:
    """Select nothing."""
    return replace(state, selection=None)


def set_range(state: AppState, range_px: tuple[float, float]) -> AppState:
    """Set the range of disparity that was found at the selected place."""
    return state if state.selection is None else replace(state, selection=replace(state.selection, range_px=range_px))


def paint(state: AppState, place: tuple[float, float], erases: bool, begins: bool) -> AppState:
    """Add to the selection along a path of the brush, or erase from it. Without a selection, the path is one.

    begins: whether this place begins another path.
    """
    if state.scene is None or (state.selection is None and erases):
        return state
    chosen = state.selection or Selection(place, is_painted=True)
    patches = chosen.patches
    if begins or not patches:
        patches = (*patches, Patch((place,), state.brush.radius, erases))[:MAX_PATCHES]
    else:
        last = patches[-1]
        points = longer_path(last.points, place, last.radius, state.scene.size, MAX_POINTS)
        patches = patches if points is last.points else (*patches[:-1], replace(last, points=points))
    return state if patches is chosen.patches else replace(state, selection=replace(chosen, patches=patches))


def surface_stroke(tool: BrushTool, chosen: Selection, brush: Brush) -> Stroke:
    """Return the stroke that changes the whole selection."""
    tolerance, feather, place = brush.tolerance, brush.feather, NOWHERE if chosen.is_painted else chosen.place
    return Stroke(tool, (place,), HOLE_RADIUS, MOVE_SHARE, None, tolerance, chosen.patches, feather)


@undoable
def move(state: AppState, scene: Scene, is_forward: bool) -> AppState:
    """Move the selected surface nearer or farther by MOVE_SHARE of the range of depth."""
    if state.selection is None or state.stroke is not None:
        return state
    edits = state.depth.edits
    stroke = surface_stroke("forward" if is_forward else "back", state.selection, state.brush)
    depth = replace(state.depth, edits=replace(edits, strokes=(*edits.strokes, stroke)))
    return replace(state, depth=depth, generation=state.generation + 1)


def keep_sharp(state: AppState) -> AppState:
    """Focus on the selected surface, with a range of focus that holds all of it."""
    if state.selection is None or state.selection.range_px is None:
        return state
    (x, y), (far, near) = state.selection.place, state.selection.range_px
    focused = lens.focus_on(state, (2 * x - 1, 2 * y - 1), (far + near) / 2)
    focused = lens.set_focus_range(focused, (near - far) / 2)
    return record_edit(state, replace(focused, history=state.history), "keep_sharp")
