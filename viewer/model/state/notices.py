"""Messages to the user."""

from __future__ import annotations

import math
from dataclasses import dataclass

from viewer.model.state.saving import SavedSettings

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
