"""Records of the open photo's file and of the photos beside it."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import PurePath

from iibr_core.exports.photo_folder import FolderPhoto
from iibr_core.scenes.scene import Source


@dataclass(frozen=True)
class PhotoFolder:
    """A folder and its photos in order.

    step: direction of the last step, 1 or -1; stepped_to: name of the photo that it asked for, "" before the first;
    is_walk: whether the photo before was stepped to, too.
    scrolled: number of photos by which the filmstrip was moved. unreadable: names of photos that did not open; steps
    pass them by.
    """

    path: str
    photos: tuple[FolderPhoto, ...]
    step: int = 1
    stepped_to: str = ""
    is_walk: bool = False
    scrolled: int = 0
    unreadable: frozenset[str] = frozenset()

    def is_stepped_to(self, source: Source) -> bool:
        """Return whether the last step asked for this source."""
        return str(PurePath(self.path) / self.stepped_to) == source.path


@dataclass(frozen=True)
class PhotoFacts:
    """Facts that the file of a photo states, as (name, value), for people."""

    path: str
    facts: tuple[tuple[str, str], ...] = ()


@dataclass(frozen=True)
class Thumbnail:
    """GL name of a texture, and its width / height."""

    texture: int
    aspect: float
