"""A picture on its way to a file: what the panel says of it, and the action that changes that."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Saving:
    """The picture that is being saved. name: of its file. drawn: share that is drawn, 0..1; at 1 it is being written.

    waiting: how many more wait for it. seconds_left: about, None where that is not known.
    """

    name: str
    drawn: float = 0.0
    waiting: int = 0
    seconds_left: int | None = None


@dataclass(frozen=True)
class SavingChanged:
    """Another picture is being saved, or it has come further; None: nothing is any more."""

    saving: Saving | None


@dataclass(frozen=True)
class CopyTask:
    """Put the picture, at the size of the views, into the system's clipboard."""


@dataclass(frozen=True)
class PasteTask:
    """Open what the system's clipboard holds: a picture, or the path of one."""


@dataclass(frozen=True)
class WriteSidecarTask:
    """Keep what the photo is left with beside it too, for other machines."""


@dataclass(frozen=True)
class CancelSaveTask:
    """Give up the picture that is being drawn for a file; the next one follows."""
