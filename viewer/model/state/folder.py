"""The photos that lie beside the one that is open, and the actions that go from one to the next.

`viewer.model.reducers.folder_reducer` says what each action does.
"""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.exports.photo_folder import FolderOrder, FolderPhoto


@dataclass(frozen=True)
class PhotoFolder:
    """A folder and its photos, in the order in which one goes through them. step: of the last, 1 or -1.

    stepped_to: the name of the photo that the last step asked for, "" before the first. scrolled: the filmstrip
    shows what lies so many photos after the one that is open. unreadable: names of those that could not be opened:
    steps pass them by.
    """

    path: str
    photos: tuple[FolderPhoto, ...]
    step: int = 1
    stepped_to: str = ""
    scrolled: int = 0
    unreadable: frozenset[str] = frozenset()


@dataclass(frozen=True)
class Thumbnail:
    """A part of the texture of this GL name. low, high: its corners (x, y) in the texture, 0..1. aspect: width over
    height.
    """

    texture: int
    low: tuple[float, float]
    high: tuple[float, float]
    aspect: float


@dataclass(frozen=True)
class FolderListed:
    """These photos lie in this folder."""

    path: str
    photos: tuple[FolderPhoto, ...]


@dataclass(frozen=True)
class StepPhoto:
    """Open the photo so many after the one that is open; the first or the last where there are not so many, the one
    beyond where that could not be opened.
    """

    steps: int


@dataclass(frozen=True)
class ScrollFilmstrip:
    """Show what lies so many photos farther."""

    photos: int


@dataclass(frozen=True)
class SetFolderOrder:
    """Go through the photos by name, or by the time they were written."""

    order: FolderOrder


@dataclass(frozen=True)
class ListFolderTask:
    """Look which photos lie in this folder."""

    path: str


FolderAction = FolderListed | StepPhoto | ScrollFilmstrip | SetFolderOrder
