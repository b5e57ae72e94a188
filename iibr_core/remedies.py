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
    VIEW_ORDER = auto()
    """State the order of the views of a light field."""


class FixableError(InputError):
    """Bad input with a known remedy. The message is what is wrong; each interface adds its words for the remedy."""

    def __init__(self, message: str, remedy: Remedy | None = None) -> None:
        super().__init__(message)
        self.remedy = remedy


def remedy_of(error: Exception) -> Remedy | None:
    """Return the remedy of an error, None if none is known."""
    return error.remedy if isinstance(error, FixableError) else None


def with_remedy(error: Exception, words: Mapping[Remedy, str]) -> str:
    """Return the message of an error, followed by the words of an interface for its remedy."""
    remedy = remedy_of(error)
    return str(error) if remedy is None else f"{error}; {words[remedy]}"
