"""Notices and prompts."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from viewer.model.action import Setter, setter

if TYPE_CHECKING:
    from viewer.model.app_state import AppState, Prompt
    from viewer.model.saving import SavedSettings


RESULT_S, NOTE_S, OFFER_S = 6.0, 12.0, 30.0
"""Seconds for which results, notes, and notices with an offer are shown."""


@dataclass(frozen=True)
class Notice:
    """A message that the user can close.

    offer: settings that a button takes over. commands: names of commands that help, a button each. is_result: whether
    it is the result of a request, and stays when another photo is opened. path: file or folder that was written.
    details: text behind a button. failed_model: name of a model that could not be downloaded, for buttons that help.
    """

    text: str
    is_error: bool = False
    offer: SavedSettings | None = None
    commands: tuple[str, ...] = ()
    is_result: bool = False
    path: str = ""
    details: str = ""
    failed_model: str = ""

    @property
    def seconds(self) -> float:
        """Seconds for which it is shown; errors stay until they are closed."""
        if self.is_error:
            return math.inf
        if self.offer is not None or self.commands:
            return OFFER_S
        return RESULT_S if self.is_result else NOTE_S


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
