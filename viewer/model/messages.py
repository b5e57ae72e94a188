"""Notices and prompts."""

from __future__ import annotations

from dataclasses import replace

from viewer.model.action import Setter, setter
from viewer.model.state.app_state import AppState
from viewer.model.state.notices import Notice
from viewer.model.state.prompts import Prompt

MAX_NOTICES = 5


def notify(state: AppState, notice: Notice) -> AppState:
    """Show a notice last, in place of the same one; the oldest goes. An error keeps the window open."""
    others = tuple(other for other in state.notices if other != notice)
    quits = state.quits_when_done and not notice.is_error
    return replace(state, notices=(*others, notice)[-MAX_NOTICES:], quits_when_done=quits)


def dismiss(state: AppState, notice: Notice | None = None) -> AppState:
    """Remove a notice, or all of them."""
    return replace(state, notices=() if notice is None else tuple(other for other in state.notices if other != notice))


def show_details(state: AppState, notice: Notice) -> AppState:
    """Show the details of a notice in its text."""
    detailed = replace(notice, text=f"{notice.text} {notice.details}", details="")
    return replace(state, notices=tuple(detailed if other == notice else other for other in state.notices))


show_prompt: Setter[Prompt | None] = setter("prompt")
"""Show a prompt in place of any other, or as the user has edited it; None closes it."""
