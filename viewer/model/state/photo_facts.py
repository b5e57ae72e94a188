"""Facts that a photo's file states, such as camera and exposure."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ReadFactsTask:
    """Read the facts that a photo's file states."""

    path: str


@dataclass(frozen=True)
class PhotoFacts:
    """Facts of a photo, (name, value), in words."""

    path: str
    facts: tuple[tuple[str, str], ...] = ()


NO_FACTS = PhotoFacts("")
