"""Messages to the user."""

from __future__ import annotations

from dataclasses import dataclass

from viewer.model.state.saving import SavedSettings

SHORT_NOTICE_S, LONG_NOTICE_S = 12.0, 30.0


@dataclass(frozen=True)
class Notice:
    """A message the user can dismiss, or wait for it to go. offer: settings that a button beside it takes over.

    commands: names of commands that do what it advises, a button each. stays: when another photo is opened.
    """

    text: str
    is_error: bool = False
    offer: SavedSettings | None = None
    commands: tuple[str, ...] = ()
    stays: bool = False

    @property
    def seconds(self) -> float:
        """How long it stays: long enough to be read, and to reach for what it offers."""
        return LONG_NOTICE_S if self.is_error or self.offer is not None or self.commands else SHORT_NOTICE_S
