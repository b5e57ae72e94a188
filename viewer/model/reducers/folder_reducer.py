"""Going from photo to photo: which lies next, which are likely to be wanted soon, which the filmstrip shows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import replace
from pathlib import PurePath

from iibr_core.exports.photo_folder import FolderPhoto, in_order
from iibr_core.scenes.scene import Source, source_beside
from viewer.model.state.app_state import AppState
from viewer.model.state.folder import PhotoFolder

AHEAD = (1, -1, 2)
"""Photos read ahead, in steps on in the direction of the last step, the likeliest first."""
SKETCHED_AHEAD = (1, 2, -1, 3, -2)
"""The same, in small: one may go on before any of them is read whole."""


def list_folder(state: AppState, path: str, photos: Iterable[FolderPhoto]) -> AppState:
    """The state that knows what lies in the folder of what is open."""
    ordered = in_order(photos, state.preferences.folder_order)
    if state.folder is not None and (state.folder.path, state.folder.photos) == (path, ordered):
        return state
    return replace(state, folder=PhotoFolder(path, ordered))


def place_of_photo(folder: PhotoFolder, source: Source | None) -> int | None:
    """Index of what is asked for among the folder's photos; None where it lies elsewhere."""
    path = PurePath(source.path) if source is not None else None
    if path is None or str(path.parent) != folder.path:
        return None
    names = [photo.name for photo in folder.photos]
    return names.index(path.name) if path.name in names else None


def photo_after(state: AppState, steps: int) -> Source | None:
    """What to open so many photos on, or beyond where that is known as unreadable; None at the folder's ends, and where
    no photo is open.
    """
    folder = state.folder
    place = None if folder is None else place_of_photo(folder, state.source)
    if folder is None or place is None:
        return None
    last = len(folder.photos) - 1
    wanted = min(max(place + steps, 0), last)
    beyond = range(wanted, last + 1) if steps > 0 else range(wanted, -1, -1)
    names = (folder.photos[i].name for i in beyond if i != place)
    name = next((name for name in names if name not in folder.unreadable), None)
    return None if name is None else source_beside(state.source, str(PurePath(folder.path) / name))


def is_stepped_to(folder: PhotoFolder | None, source: Source) -> bool:
    """Whether this is what the last step from photo to photo asked for."""
    return folder is not None and str(PurePath(folder.path) / folder.stepped_to) == source.path


def photos_ahead(state: AppState, places: Sequence[int]) -> tuple[Source, ...]:
    """What will be wanted soon, the likeliest first. places: so many steps on in the direction of the last."""
    step = state.folder.step if state.folder is not None else 1
    found = (photo_after(state, step * steps) for steps in places)
    return tuple(dict.fromkeys(source for source in found if source is not None))


def filmstrip_range(state: AppState, most: int) -> range:
    """Indices of the photos that a filmstrip of so many shows: the open one in its middle, as far as it was not
    scrolled.
    """
    folder = state.folder
    if folder is None or most < 1:
        return range(0)
    middle = (place_of_photo(folder, state.source) or 0) + folder.scrolled
    count = min(most, len(folder.photos))
    first = min(max(middle - count // 2, 0), len(folder.photos) - count)
    return range(first, first + count)


def scroll_filmstrip(state: AppState, photos: int) -> AppState:
    """The state with the filmstrip moved on, no farther than there are photos."""
    folder = state.folder
    if folder is None:
        return state
    place = place_of_photo(folder, state.source) or 0
    scrolled = min(max(folder.scrolled + photos, -place), len(folder.photos) - 1 - place)
    return replace(state, folder=replace(folder, scrolled=scrolled))
