"""Verbs of the lens: viewpoint, focus, aperture, light, gloss. They can be undone.

Without a scene, or with numbers that are not finite, they change nothing; other numbers are clamped to the scene.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

from iibr_core.beyond.optics import ApertureShape, Optics
from iibr_core.gloss.settings import MAX_STROKE_POINTS, STROKE_RADIUS_LIMITS, Gloss, GlossStroke, GlossSurface
from iibr_core.scenes.lens_limits import clamp, clamp_optics, first_aperture, is_finite
from iibr_core.scenes.scene import Scene
from iibr_core.types import ViewOffset
from viewer.model import focal_plane
from viewer.model.action import Setter
from viewer.model.history import record_edit, undoable
from viewer.model.presets import PresetName, preset_optics, subject_disparity
from viewer.model.stroke_path import longer_path

if TYPE_CHECKING:
    from viewer.model.app_state import AppState


FIRST_GLOSS = Gloss(GlossSurface(farthest=0.5))
"""Gloss that the panel's switch begins with: the nearer half of the scene."""


@dataclass(frozen=True)
class TiltHandles:
    """Two places that the sharp plane runs through, (x, y) from -1 to 1 across the picture, y down.

    taken: index of the handle that is being dragged.
    """

    first: tuple[float, float] = (-0.5, 0.4)
    second: tuple[float, float] = (0.5, -0.4)
    taken: int | None = None


@dataclass(frozen=True)
class GlossBrush:
    """The brush that marks the glossy surface, or erases a part of it, while it is on. radius: see `GlossStroke`."""

    radius: float = 0.04
    erases: bool = False
    is_on: bool = False


DEPTH_STRENGTH_LIMIT = 4.0


def _edited(state: AppState, scene: Scene, optics: Optics) -> AppState:
    """Return the state with these optics, clamped; the same state if a number is not finite."""
    if not is_finite(optics):
        return state
    return replace(state, optics=clamp_optics(optics, scene), shows_before=False)


def _lens_setter(name: str) -> Setter[Any]:
    """Return the verb that sets a field of the optics, see `Optics`."""

    def verb(state: AppState, scene: Scene, value: Any, /) -> AppState:
        return _edited(state, scene, replace(state.optics, **{name: value}))

    verb.__name__ = name
    return undoable(verb)


def _still(state: AppState) -> AppState:
    """Return the state without a motion of the viewpoint."""
    return replace(state, motion=state.motion.stopped)


def _without_rack(state: AppState) -> AppState:
    """Return the state without a motion of the focus."""
    return _still(state) if state.motion.kind == "rack" else state


# Viewpoint


@undoable
def move_eye(state: AppState, scene: Scene, eye: ViewOffset) -> AppState:
    """Put the viewpoint at a view offset."""
    return _edited(_still(state), scene, replace(state.optics, eye=eye))


@undoable
def set_dolly(state: AppState, scene: Scene, dolly: float) -> AppState:
    """Step into the picture; see `Optics.dolly`."""
    return _edited(_still(state), scene, replace(state.optics, dolly=dolly))


@undoable
def reset(state: AppState, scene: Scene) -> AppState:
    """Reset viewpoint, focus, aperture and light; gloss stays."""
    state = replace(_still(state), free_camera=None, tilt_handles=None, has_chosen_aperture=False)
    state = replace(state, chosen_focus=None, focus_before=None, focused_at=None)
    return _edited(state, scene, Optics(gloss=state.optics.gloss))


# Focus


@undoable
def set_focus(state: AppState, scene: Scene, disparity: float) -> AppState:
    """Focus on a field disparity (px per view step) in the middle of the picture."""
    focused = _edited(_without_rack(state), scene, replace(state.optics, focus_disparity=disparity))
    return _opened(replace(focused, chosen_focus=focused.optics.focus_disparity, focused_at=None), scene)


def focus_on(state: AppState, place: focal_plane.Place, disparity: float) -> AppState:
    """Focus on what was clicked at a place (-1..1, see `focal_plane`), with its disparity."""
    if state.scene is None or not all(map(math.isfinite, (*place, disparity))):
        return state
    focused = _edited(_without_rack(state), state.scene, focal_plane.focus_on(state.optics, place, disparity))
    before = state.focus_before if disparity == state.chosen_focus else state.chosen_focus
    focused = replace(focused, chosen_focus=disparity, focus_before=before, focused_at=place)
    # a click is recorded even if nothing changed: a double click takes it back
    return record_edit(state, _opened(focused, state.scene), "focus_on", always=True)


set_focus_range: Setter[float] = _lens_setter("focus_range")
"""Make everything within this much disparity of the focus sharp."""
set_focus_tilt: Setter[tuple[float, float]] = _lens_setter("focus_tilt")


def show_tilt_handles(state: AppState, is_shown: bool) -> AppState:
    """Show or hide the handles over the picture."""
    return replace(state, tilt_handles=TiltHandles() if is_shown else None)


@undoable
def move_tilt_handle(
    state: AppState, scene: Scene, index: int, place: focal_plane.Place, disparity: float | None
) -> AppState:
    """Drag a handle (0 or 1) to a place; the plane of focus runs through the disparity there, None if unknown."""
    handles = state.tilt_handles or TiltHandles()
    x, y = (clamp(value, -1.0, 1.0) for value in place)
    old, kept = (handles.first, handles.second) if index == 0 else (handles.second, handles.first)
    disparity = focal_plane.sharp_disparity(state.optics, old) if disparity is None else disparity
    optics = focal_plane.tilt_through(state.optics, (x, y), disparity, kept, scene.height / scene.width)
    tilted = _edited(state, scene, optics)
    first, second = ((x, y), kept) if index == 0 else (kept, (x, y))
    return state if tilted is state else replace(tilted, tilt_handles=TiltHandles(first, second, taken=index))


def _opened(state: AppState, scene: Scene) -> AppState:
    """Return the state with the aperture opened a little, unless the user chose it: a pinhole has no focus."""
    if state.has_chosen_aperture or state.optics.aperture_diameter > 0:
        return state
    return replace(state, optics=replace(state.optics, aperture_diameter=first_aperture(scene)))


# Aperture and light


@undoable
def set_aperture(state: AppState, scene: Scene, diameter: float) -> AppState:
    """Open the aperture to a diameter in view steps."""
    opened = replace(state, has_chosen_aperture=True)
    return _edited(opened, scene, replace(state.optics, aperture_diameter=diameter))


@undoable
def apply_preset(state: AppState, scene: Scene, name: PresetName) -> AppState:
    """Set focus and aperture for a purpose."""
    optics = preset_optics(name, state.optics, scene, subject_disparity(state, scene))
    return _edited(replace(state, has_chosen_aperture=True, tilt_handles=None), scene, optics)


set_aperture_shape: Setter[ApertureShape] = _lens_setter("aperture_shape")
set_highlights: Setter[float] = _lens_setter("highlight_recovery")
set_exposure: Setter[float] = _lens_setter("exposure_stops")


def show_before(state: AppState, is_shown: bool) -> AppState:
    """Show the photo as it was taken, or the picture again."""
    return replace(state, shows_before=is_shown and state.scene is not None)


@undoable
def set_depth_strength(state: AppState, scene: Scene, strength: float, is_finished: bool) -> AppState:
    """Multiply the planned parallax. is_finished: the edit is over, so the field is made again."""
    generation = state.generation + 1 if is_finished else state.generation
    return replace(state, depth_strength=clamp(strength, 0.0, DEPTH_STRENGTH_LIMIT), generation=generation)


def requested_strength(state: AppState) -> float:
    """Return the depth strength of the scene that was asked for last; the next photo begins with the usual one."""
    is_next = state.scene is not None and state.scene.source is not state.source
    return 1.0 if is_next else state.depth_strength


# Gloss


set_gloss: Setter[Gloss | None] = _lens_setter("gloss")
"""Make a surface glossy; None: no surface."""


def take_gloss_brush(state: AppState, brush: GlossBrush) -> AppState:
    """Take the gloss brush, or put it away; the depth brush is put away."""
    depth_brush = replace(state.brush, is_on=state.brush.is_on and not brush.is_on)
    taken = replace(brush, radius=clamp(brush.radius, *STROKE_RADIUS_LIMITS))
    return replace(state, gloss_brush=taken, brush=depth_brush)


@undoable
def paint_gloss(state: AppState, scene: Scene, place: tuple[float, float], brush: GlossBrush, begins: bool) -> AppState:
    """Begin a stroke of the gloss brush at a place (x, y), in shares of the photo's size, or continue the last one."""
    gloss = state.optics.gloss
    if gloss is None:
        return state
    strokes, place = gloss.surface.strokes, (clamp(place[0], -1.0, 2.0), clamp(place[1], -1.0, 2.0))
    stroke = GlossStroke((place,), brush.radius, brush.erases)
    if strokes and not begins:
        last = strokes[-1]
        points = longer_path(last.points, place, last.radius, scene.size, MAX_STROKE_POINTS)
        if points is last.points:
            return state
        strokes, stroke = strokes[:-1], replace(last, points=points)
    painted = replace(gloss, surface=replace(gloss.surface, strokes=(*strokes, stroke)))
    return replace(state, optics=replace(state.optics, gloss=painted))
