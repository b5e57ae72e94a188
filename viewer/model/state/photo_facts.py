"""What is known about the photo that is open, beside what it shows: asked of the outside world, shown in the panel."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class ReadFactsTask:
    """Read what this photo's file says about it."""

    path: str


@dataclass(frozen=True)
class PhotoFacts:
    """What the photo's file says: (what, value), for people."""

    path: str
    facts: tuple[tuple[str, str], ...] = ()


NO_FACTS = PhotoFacts("")
