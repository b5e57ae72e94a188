"""Undo and redo. An edit stores the state that it replaced; all steps of a drag are one edit."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import wraps
from typing import TYPE_CHECKING, Concatenate, ParamSpec

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.scene import AS_FOUND, DepthSettings, Scene

if TYPE_CHECKING:
    from viewer.model.app_state import AppState


@dataclass(frozen=True)
class Edit:
    """The part of the state that undo restores."""

    optics: Optics
    depth_strength: float
    depth: DepthSettings = AS_FOUND


@dataclass(frozen=True)
class History:
    """Edits to undo (the latest last) and to redo (the next first), in the units of the open scene.

    last: kind of the latest edit. gesture: that kind while its gesture lasts, "" after: more edits of this kind
    belong to it until the pointer goes down or up.
    """

    past: tuple[Edit, ...] = ()
    future: tuple[Edit, ...] = ()
    last: str = ""
    gesture: str = ""


MAX_EDITS = 200
"""Number of edits that can be undone."""
P = ParamSpec("P")


def record_edit(before: AppState, after: AppState, kind: str, always: bool = False) -> AppState:
    """Return `after` with the edit in its history. Edits of one kind in one gesture are one edit.

    always: record the edit even if nothing changed.
    """
    if _edit_of(before) == _edit_of(after) and not always:
        return after
    past = after.history.past
    if after.history.gesture != kind:
        past = (*past, _edit_of(before))[-MAX_EDITS:]
    return replace(after, history=History(past, (), kind, kind))


def undoable(
    verb: Callable[Concatenate[AppState, Scene, P], AppState],
) -> Callable[Concatenate[AppState, P], AppState]:
    """Return the verb that changes the open scene's state by this function; without a scene it changes nothing.

    Its edit can be undone. Steps of one gesture by the same verb are one edit.
    """

    @wraps(verb)
    def recorded(state: AppState, /, *args: P.args, **kwargs: P.kwargs) -> AppState:
        scene = state.scene
        return state if scene is None else record_edit(state, verb(state, scene, *args, **kwargs), verb.__name__)

    return recorded


def undo(state: AppState) -> AppState:
    """Return the state before the last edit that made a difference."""
    now, past = _edit_of(state), state.history.past
    while past and past[-1] == now:
        past = past[:-1]
    if not past:
        return replace(state, history=replace(state.history, past=()))
    return _restore(state, past[-1], History(past[:-1], (now, *state.history.future)))


def redo(state: AppState) -> AppState:
    """Return the state before the last `undo`."""
    if not state.history.future:
        return state
    edit, *rest = state.history.future
    return _restore(state, edit, History((*state.history.past, _edit_of(state)), tuple(rest)))


def map_optics(history: History, carried: Callable[[Optics], Optics]) -> History:
    """Return the history with the optics of all edits mapped to another plan of the same scene."""
    past, future = (
        tuple(replace(edit, optics=carried(edit.optics)) for edit in edits) for edits in (history.past, history.future)
    )
    return replace(history, past=past, future=future)


def _edit_of(state: AppState) -> Edit:
    return Edit(state.optics, state.depth_strength, state.depth)


def _restore(state: AppState, edit: Edit, history: History) -> AppState:
    """Return the state with an edit restored. Another depth needs a new field, which carries the optics over."""
    is_same_depth = (edit.depth_strength, edit.depth) == (state.depth_strength, state.depth)
    restarts = not is_same_depth and state.source is not None
    return replace(
        state,
        optics=edit.optics,
        depth_strength=edit.depth_strength,
        depth=edit.depth,
        generation=state.generation + 1 if restarts else state.generation,
        motion=state.motion.stopped,
        history=history,
    )
