"""What begins, holds and ends motions of the viewpoint; `camera_motion` says along which path they go."""

from __future__ import annotations

import math
from dataclasses import replace

from iibr_core.scenes.lens_limits import clamp, clamp_optics
from viewer.model.reducers.camera_motion import advance_motion, start_motion
from viewer.model.reducers.history_reducer import record_edit
from viewer.model.state.app_state import AppState
from viewer.model.state.motion import (
    MotionAction,
    PauseMotion,
    ReturnHome,
    SetLoop,
    SetSpeed,
    Tick,
)
from viewer.model.window_limits import SPEED_LIMITS


def reduce_motion(state: AppState, action: MotionAction) -> AppState:
    """The state after an action that begins, holds or ends a motion; without a scene there is none."""
    motion, scene = state.motion, state.scene
    if scene is None:
        return state
    match action:
        case ReturnHome(takes_back_click):
            state = replace(_without_click(state) if takes_back_click else state, free_camera=None)
            gliding = replace(state, motion=start_motion(motion, "home", state.optics))
            return record_edit(state, gliding, "ReturnHome", always=True)
        case SetLoop(kind):
            return record_edit(
                state, replace(state, motion=start_motion(motion, kind, state.optics)), "SetLoop", always=True
            )
        case SetSpeed(speed) if math.isfinite(speed):
            return replace(state, motion=replace(motion, speed=clamp(speed, *SPEED_LIMITS)))
        case PauseMotion(is_paused):
            return replace(state, motion=replace(motion, is_paused=is_paused, ticked_s=None))
        case Tick(now_s):
            motion, optics = advance_motion(motion, state.optics, scene.grid, now_s)
            return replace(state, motion=motion, optics=clamp_optics(optics, scene))
    return state


def _without_click(state: AppState) -> AppState:
    """A double click is a click first, and that has set the focus: take it back."""
    history = state.history
    if history.last != "FocusOn" or not history.past:
        return state
    return replace(state, optics=history.past[-1].optics, history=replace(history, past=history.past[:-1], last=""))
