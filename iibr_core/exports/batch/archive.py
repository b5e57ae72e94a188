"""The photos of an archive: what lies in its folders, at any depth, and the name that each one's export gets."""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import NamedTuple

from iibr_core.exports.photo_folder import list_photos
from iibr_core.formats.files import is_folder
from iibr_core.types import InputError


class ArchivePhoto(NamedTuple):
    """A photo, and the name of what is made of it, without ending, relative to the folder of all exports."""

    path: str
    name: str


def photos_in(folders: Sequence[Path]) -> list[ArchivePhoto]:
    """Every photo in these folders and those below, without hidden ones and those behind links to folders.

    Names repeat the folders; where there are several, each begins with the name of its own. Raises InputError for what
    is no folder, and for two folders of one name.
    """
    for folder in folders:
        if not is_folder(folder):
            raise InputError(f"{folder}: no such folder")
    tops = [Path(os.path.abspath(folder)).name if len(folders) > 1 else "" for folder in folders]
    twice = next((top for top, count in Counter(tops).items() if count > 1), None)
    if twice is not None:
        raise InputError(f"{twice}: two folders of this name would become one; give them one after the other")
    return [photo for folder, top in zip(folders, tops) for photo in _photos_below(folder, top)]


def _photos_below(folder: Path, top: str) -> Iterator[ArchivePhoto]:
    for place, below, _ in os.walk(folder):
        below[:] = sorted(name for name in below if not name.startswith("."))
        inner = os.path.normpath(os.path.join(top, os.path.relpath(place, folder)))
        names = sorted(photo.name for photo in list_photos(place))
        for name, own in zip(names, _own_names(names)):
            yield ArchivePhoto(os.path.join(place, name), os.path.normpath(os.path.join(inner, own)))


def _own_names(names: Sequence[str]) -> list[str]:
    """Names without their endings, but for those that would then be the same as another's, in capitals or not."""
    stems = Counter(os.path.splitext(name)[0].casefold() for name in names)
    whole = {name.casefold() for name in names}
    return [
        stem if stems[stem.casefold()] == 1 and stem.casefold() not in whole else name
        for name, stem in ((name, os.path.splitext(name)[0]) for name in names)
    ]
