"""Notices: the newest last, the oldest go."""

from __future__ import annotations

from dataclasses import replace

from viewer.model.state.app_state import AppState
from viewer.model.state.notices import Notice
from viewer.model.window_words import words_in_window

NOTICES_KEPT = 5


def add_notice(state: AppState, notice: Notice) -> AppState:
    """The state with one more notice, in the window's words; the same again takes the place of the earlier."""
    notice = replace(notice, text=words_in_window(notice.text))
    others = tuple(other for other in state.notices if other != notice)
    return replace(state, notices=(*others, notice)[-NOTICES_KEPT:])
