"""The photos of a folder: verbs that go from one to the next, and what the filmstrip shows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import PurePath

from iibr_core.exports.photo_folder import FolderOrder, FolderPhoto, in_order
from iibr_core.scenes.scene import Source, source_beside
from viewer.model import opening
from viewer.model.action import Setter, setter
from viewer.model.app_state import AppState


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


set_facts: Setter[PhotoFacts] = setter("facts")
"""Show the facts that a photo's file states."""

AHEAD = (1, -1, 2)
"""Photos read ahead, in steps in the direction of the last step, the likeliest first."""
SKETCHED_AHEAD = (1, 2, -1, 3, -2)
"""Photos read at a small size ahead, in the same order."""


def set_photos(state: AppState, path: str, photos: Iterable[FolderPhoto]) -> AppState:
    """Take over the list of photos in the folder of the open photo."""
    ordered = in_order(photos, state.preferences.folder_order)
    if state.folder is not None and (state.folder.path, state.folder.photos) == (path, ordered):
        return state
    return replace(state, folder=PhotoFolder(path, ordered))


def set_order(state: AppState, order: FolderOrder) -> AppState:
    """Sort the photos by name, or by the time they were written."""
    state = replace(state, preferences=replace(state.preferences, folder_order=order))
    return state if state.folder is None else set_photos(state, state.folder.path, state.folder.photos)


def step(state: AppState, steps: int) -> AppState:
    """Open the photo `steps` after the open one, see `photo_after`."""
    source = photo_after(state, steps)
    if source is None or state.folder is None:
        return state
    name = PurePath(source.path).name
    is_walk = state.source is not None and state.folder.is_stepped_to(state.source)
    folder = replace(state.folder, step=1 if steps > 0 else -1, stepped_to=name, scrolled=0, is_walk=is_walk)
    return opening.open_source(replace(state, folder=folder), source)


def scroll(state: AppState, photos: int) -> AppState:
    """Move the filmstrip by a number of photos, at most to its ends."""
    folder = state.folder
    if folder is None:
        return state
    place = place_of_photo(folder, state.source) or 0
    scrolled = min(max(folder.scrolled + photos, -place), len(folder.photos) - 1 - place)
    return replace(state, folder=replace(folder, scrolled=scrolled))


def place_of_photo(folder: PhotoFolder, source: Source | None) -> int | None:
    """Return the index of a source among the folder's photos, None if it lies elsewhere."""
    path = PurePath(source.path) if source is not None else None
    if path is None or str(path.parent) != folder.path:
        return None
    names = [photo.name for photo in folder.photos]
    return names.index(path.name) if path.name in names else None


def photo_after(state: AppState, steps: int) -> Source | None:
    """Return the photo `steps` after the open one, or the next beyond it that can be read; None if there is none."""
    folder = state.folder
    place = None if folder is None else place_of_photo(folder, state.source)
    if folder is None or place is None or steps == 0:
        return None
    last = len(folder.photos) - 1
    wanted = min(max(place + steps, 0), last)
    beyond = range(wanted, last + 1) if steps > 0 else range(wanted, -1, -1)
    names = (folder.photos[i].name for i in beyond if i != place)
    name = next((name for name in names if name not in folder.unreadable), None)
    return None if name is None else source_beside(state.source, str(PurePath(folder.path) / name))


def photos_ahead(state: AppState, places: Sequence[int]) -> tuple[Source, ...]:
    """Return photos that are likely to be wanted soon. places: steps in the direction of the last step."""
    direction = state.folder.step if state.folder is not None else 1
    found = (photo_after(state, direction * steps) for steps in places)
    return tuple(dict.fromkeys(source for source in found if source is not None))


def filmstrip_range(state: AppState, count: int) -> range:
    """Return the indices of the photos in a filmstrip of at most `count`: the open one is in its middle, unless it was
    scrolled.
    """
    folder = state.folder
    if folder is None or count < 1:
        return range(0)
    middle = (place_of_photo(folder, state.source) or 0) + folder.scrolled
    count = min(count, len(folder.photos))
    first = min(max(middle - count // 2, 0), len(folder.photos) - count)
    return range(first, first + count)
