"""Undo and redo. An edit is remembered by what it replaced; a drag is one edit, however many steps it took."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import wraps
from typing import Concatenate, ParamSpec

from iibr_core.beyond.optics import Optics
from viewer.model.state.app_state import AppState
from viewer.model.state.history import Edit, History
from viewer.model.state.motion import Motion

EDITS_KEPT = 200
P = ParamSpec("P")


def edit_of(state: AppState) -> Edit:
    """What undo would bring back if something else took its place."""
    return Edit(state.optics, state.depth_strength, state.depth)


def record_edit(before: AppState, after: AppState, kind: str, always: bool = False) -> AppState:
    """`after`, with what it replaced remembered; nothing if nothing changed, unless `always`.

    kind: edits of one kind in a row are one, until the gesture ends.
    """
    if edit_of(before) == edit_of(after) and not always:
        return after
    past = after.history.past
    if after.history.gesture != kind:
        past = (*past, edit_of(before))[-EDITS_KEPT:]
    return replace(after, history=History(past, (), kind, kind))


def undoable(verb: Callable[Concatenate[AppState, P], AppState]) -> Callable[Concatenate[AppState, P], AppState]:
    """Return a verb whose edit can be undone. Steps of one gesture by the same verb are one edit."""

    @wraps(verb)
    def recorded(state: AppState, /, *args: P.args, **kwargs: P.kwargs) -> AppState:
        return record_edit(state, verb(state, *args, **kwargs), verb.__name__)

    return recorded


def end_gesture(state: AppState) -> AppState:
    """The next edit is one of its own, and no tilt handle is held."""
    if state.tilt_handles is not None and state.tilt_handles.taken is not None:
        state = replace(state, tilt_handles=replace(state.tilt_handles, taken=None))
    return replace(state, history=replace(state.history, gesture="")) if state.history.gesture else state


def undo(state: AppState) -> AppState:
    """The state before the last edit that made a difference; without one, the same."""
    now, past = edit_of(state), state.history.past
    while past and past[-1] == now:
        past = past[:-1]
    if not past:
        return replace(state, history=replace(state.history, past=()))
    return _restore(state, past[-1], History(past[:-1], (now, *state.history.future)))


def redo(state: AppState) -> AppState:
    """The state before the last `undo`; without one, the same."""
    if not state.history.future:
        return state
    edit, *rest = state.history.future
    return _restore(state, edit, History((*state.history.past, edit_of(state)), tuple(rest)))


def map_optics(history: History, carried: Callable[[Optics], Optics]) -> History:
    """The history in the units of another plan of the same scene."""
    past, future = (
        tuple(replace(edit, optics=carried(edit.optics)) for edit in edits) for edits in (history.past, history.future)
    )
    return replace(history, past=past, future=future)


def _restore(state: AppState, edit: Edit, history: History) -> AppState:
    """Other depth needs a new field, which then brings the optics along."""
    is_same_depth = (edit.depth_strength, edit.depth) == (state.depth_strength, state.depth)
    restarts = not is_same_depth and state.source is not None
    return replace(
        state,
        optics=edit.optics,
        depth_strength=edit.depth_strength,
        depth=edit.depth,
        generation=state.generation + 1 if restarts else state.generation,
        motion=Motion(speed=state.motion.speed),
        history=history,
    )
