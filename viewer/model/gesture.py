"""The verb that ends a gesture of the pointer."""

from __future__ import annotations

from dataclasses import replace

from viewer.model.app_state import AppState
from viewer.model.depth import end_stroke
from viewer.model.inspection import release_divider


def end_gesture(state: AppState) -> AppState:
    """Release handles, divider and stroke: the next step is another edit, for undo."""
    state = release_divider(end_stroke(state))
    if state.tilt_handles is not None and state.tilt_handles.taken is not None:
        state = replace(state, tilt_handles=replace(state.tilt_handles, taken=None))
    if state.history.gesture:
        state = replace(state, history=replace(state.history, gesture=""))
    return state
