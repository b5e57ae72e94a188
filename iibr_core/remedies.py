"""Remedies of bad input, by name: the command line and the window each have their own words for them."""

from __future__ import annotations

from collections.abc import Mapping
from enum import Enum, auto

from iibr_core.types import InputError


class Remedy(Enum):
    """Way for a person to correct an error."""

    REPLACE = auto()
    """Replace the output that exists, or choose another name."""
    PLACE = auto()
    """Write to another place."""
    SMALLER = auto()
    """Make fewer or smaller views."""
    DEPTH = auto()
    """Give a depth map, or get a depth model."""
    DOWNLOAD = auto()
    """Download again, from the same place or another, or give a model file."""
    STRETCH = auto()
    """Stretch a depth map to the shape of the photo."""
    INVERT = auto()
    """Invert the depth."""
    INVERT_OR_METRIC = auto()
    """Invert the depth, or read a map as distances."""
    VIEW_ORDER = auto()
    """State the order of the views of a light field."""


class FixableError(InputError):
    """Bad input with a known remedy. The message states the fault; each interface adds its words for the remedy."""

    def __init__(self, message: str, remedy: Remedy | None = None) -> None:
        super().__init__(message)
        self.remedy = remedy


class FixableNote(str):
    """A note with a known remedy: a sentence, to which each interface may add its words."""

    remedy: Remedy

    def __new__(cls, note: str, remedy: Remedy) -> FixableNote:
        """Return a note with this remedy."""
        self = super().__new__(cls, note)
        self.remedy = remedy
        return self

    def __getnewargs__(self) -> tuple[str, Remedy]:  # type: ignore[override]
        """Return the arguments from which pickle makes the note again."""
        return str(self), self.remedy


def remedy_of(message: Exception | str) -> Remedy | None:
    """Return the remedy of an error or a note, None if none is known."""
    return message.remedy if isinstance(message, FixableError | FixableNote) else None


def with_remedy(message: Exception | str, words: Mapping[Remedy, str]) -> str:
    """Return an error or a note, followed by the words of an interface for its remedy."""
    remedy, end = remedy_of(message), "." if isinstance(message, str) else ""
    return str(message) if remedy is None else f"{str(message).removesuffix('.')}; {words[remedy]}{end}"
