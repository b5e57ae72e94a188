"""Verbs of the viewpoint: motions that run by themselves, the free camera, and zoom."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Literal

from iibr_core.beyond.optics import Optics
from iibr_core.exports.loops import LoopKind, ease, point_on_loop
from iibr_core.scenes.lens_limits import clamp, clamp_optics
from iibr_core.types import CENTRE, GridShape, ViewOffset
from viewer.model.action import Setter, setter
from viewer.model.history import record_edit
from viewer.model.layout import Zoom
from viewer.model.messages import Notice, notify

if TYPE_CHECKING:
    from viewer.model.app_state import AppState


MotionKind = LoopKind | Literal["home", "rack"]
"""home: a glide to the middle. rack: a glide of the focus from one surface to another."""
MAX_ASIDE = 0.3
"""Largest turn of the free camera to each side, in halves of the picture: 15 % of the view lies beyond the photo."""
FORWARD_LIMITS = -0.1, 0.6
"""Farthest step of the free camera back and forward, in distances of the nearest surface."""


@dataclass(frozen=True)
class Motion:
    """A viewpoint that moves by itself.

    kind: None at rest. turns: progress on the path since it began at the viewpoint `start` (and its dolly). rack: first
    and last focus disparity of a rack. ticked_s: clock at the last step, None before the first. speed: turns per
    second; it and is_paused outlast a change of kind.
    """

    kind: MotionKind | None = None
    turns: float = 0.0
    ticked_s: float | None = None
    start: ViewOffset = CENTRE
    start_dolly: float = 0.0
    rack: tuple[float, float] = (0.0, 0.0)
    speed: float = 0.25
    is_paused: bool = False

    @property
    def is_running(self) -> bool:
        """Whether the picture changes without input."""
        return self.kind is not None and not self.is_paused

    @property
    def stopped(self) -> Motion:
        """No motion; the next has the same speed."""
        return Motion(speed=self.speed)


@dataclass(frozen=True)
class FreeCamera:
    """Pose of the camera, relative to the photo's.

    right, down: the turn; 1 looks at what was at the picture's border. forward: in distances of the nearest surface.
    """

    right: float = 0.0
    down: float = 0.0
    forward: float = 0.0

    @property
    def is_at_end(self) -> bool:
        """Whether the camera has reached a limit."""
        return max(abs(self.right), abs(self.down)) >= MAX_ASIDE or self.forward in FORWARD_LIMITS


SPEED_LIMITS = 0.05, 1.0
"""Slowest and fastest motion, in turns per second."""
HOME_S = 0.4
"""Duration of the glide to the middle, in seconds."""
MAX_STEP_S = 0.1
"""Longest step of a motion, in seconds: after a delay it continues without a jump."""
RACK_S = 1.6
"""Duration of a focus rack in the window, in seconds."""
DURATIONS_S: dict[MotionKind, float] = {"home": HOME_S, "rack": RACK_S}
"""Durations of the motions that end."""
EASE_IN_TURNS = 0.2
"""Part of a loop's first turn over which it leaves its starting viewpoint."""
MIN_ZOOM = 1e-3
"""Smallest scale of a zoom."""
TWO_CLICKS = "Click two things in the picture first: the focus then glides from one to the other (X)."
PHOTOS_ONLY = "The free camera needs a photo: a light field holds only the views of its own plane."


def return_home(state: AppState, takes_back_click: bool = False) -> AppState:
    """Glide back to the middle viewpoint. takes_back_click: undo the focus set by a double click's first click."""
    if state.scene is None:
        return state
    state = replace(_without_click(state) if takes_back_click else state, free_camera=None)
    return record_edit(state, replace(state, motion=_start(state, "home")), "return_home", always=True)


def rack_focus(state: AppState) -> AppState:
    """Let the focus glide from the last click but one to the last click."""
    if state.scene is None:
        return state
    rack = clicked_rack(state)
    if rack is None:
        return notify(state, Notice(TWO_CLICKS))
    motion = replace(_start(state, "rack"), rack=rack)
    return record_edit(state, replace(state, motion=motion), "rack_focus", always=True)


def clicked_rack(state: AppState) -> tuple[float, float] | None:
    """Return the focus disparities of the last two clicks, None before them."""
    if state.focus_before is None or state.chosen_focus is None:
        return None
    return state.focus_before, state.chosen_focus


def set_loop(state: AppState, kind: LoopKind | None) -> AppState:
    """Move the viewpoint along a loop, over and over; None stops it where it is."""
    if state.scene is None:
        return state
    return record_edit(state, replace(state, motion=_start(state, kind)), "set_loop", always=True)


set_speed: Setter[float] = setter("motion.speed", SPEED_LIMITS)
"""Set the speed of loops, in turns per second."""


def pause(state: AppState, is_paused: bool) -> AppState:
    """Hold the motion, or continue it."""
    return replace(state, motion=replace(state.motion, is_paused=is_paused, ticked_s=None))


def tick(state: AppState, now_s: float) -> AppState:
    """Continue the motion up to a time on the clock, in seconds."""
    if state.scene is None or not state.motion.is_running:
        return state
    motion, optics = _advance(state.motion, state.optics, state.scene.grid, now_s)
    return replace(state, motion=motion, optics=clamp_optics(optics, state.scene))


def move_camera(state: AppState, right: float = 0.0, down: float = 0.0, forward: float = 0.0) -> AppState:
    """Turn the free camera and step forward, within its limits. Without a free camera, it leaves the views' plane."""
    if state.scene is None:
        return state
    if state.scene.plan is None:
        return notify(state, Notice(PHOTOS_ONLY))
    camera = state.free_camera or FreeCamera()
    right, down, forward = camera.right + right, camera.down + down, camera.forward + forward
    right, down = (clamp(turn, -MAX_ASIDE, MAX_ASIDE) for turn in (right, down))
    return replace(state, free_camera=FreeCamera(right, down, clamp(forward, *FORWARD_LIMITS)))


def leave_camera(state: AppState) -> AppState:
    """Return to the plane of the views."""
    return replace(state, free_camera=None)


report_camera: Setter[float | None] = setter("free_progress")
"""Show the progress of preparing the free camera's views, as a share; None when they are ready."""


def set_zoom(state: AppState, zoom: Zoom | None) -> AppState:
    """Show a part of the picture; None: the whole picture."""
    if zoom is None or state.scene is None:
        return replace(state, zoom=None)
    x, y = (clamp(at, 0.0, 1.0) for at in zoom.centre)
    return replace(state, zoom=Zoom(max(zoom.scale, MIN_ZOOM), (x, y)))


def _start(state: AppState, kind: MotionKind | None) -> Motion:
    return Motion(kind, start=state.optics.eye, start_dolly=state.optics.dolly, speed=state.motion.speed)


def _without_click(state: AppState) -> AppState:
    """Return the state before the last edit if that was a click that set the focus."""
    history = state.history
    if history.last != "focus_on" or not history.past:
        return state
    return replace(state, optics=history.past[-1].optics, history=replace(history, past=history.past[:-1], last=""))


def _advance(motion: Motion, optics: Optics, grid: GridShape, now_s: float) -> tuple[Motion, Optics]:
    """Return motion and optics at a time on the clock. Glides end where they arrive."""
    step_s = 0.0 if motion.ticked_s is None else clamp(now_s - motion.ticked_s, 0.0, MAX_STEP_S)
    duration_s = DURATIONS_S.get(motion.kind) if motion.kind is not None else None
    turns = motion.turns + (step_s * motion.speed if duration_s is None else step_s / duration_s)
    motion = replace(motion, turns=turns, ticked_s=now_s)
    if motion.kind == "rack":
        start, end = motion.rack
        focused = replace(optics, focus_disparity=start + ease(turns) * (end - start))
        return replace(motion, kind=None) if turns >= 1 else motion, focused
    if motion.kind == "home":
        if turns >= 1:
            return replace(motion, kind=None), replace(optics, eye=CENTRE, dolly=0.0)
        left = 1 - ease(turns)
        eye = ViewOffset(motion.start.t * left, motion.start.s * left)
        return motion, replace(optics, eye=eye, dolly=motion.start_dolly * left)
    share = ease(turns / EASE_IN_TURNS)
    goal = point_on_loop(motion.kind, turns, grid)
    eye = ViewOffset(*(a + share * (b - a) for a, b in zip(motion.start, goal)))
    return motion, replace(optics, eye=eye)
