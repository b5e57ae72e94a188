"""Where a path leads, and whether a file or a folder can be there without touching what is read."""

from __future__ import annotations

import os
import stat
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from iibr_core.formats.files import is_folder, reason_of, status_of
from iibr_core.types import InputError

MOST_NAME_BYTES = 255
MOST_PATH_BYTES = 4000
"""Of the 4096 that Linux takes: a temporary name needs some."""
MOST_LINKS = 40
FOLDER_LEVELS = 3
"""How deep the pictures of data sets lie below the folder that is named: scene, subfolder, picture."""


def real_place(path: Path) -> Path:
    """Where `path` leads, links followed. Raises InputError where nothing can be of that name, or nobody may look."""
    try:
        longest = max((len(os.fsencode(part)) for part in path.parts), default=0)
        real = Path(os.path.realpath(path))
    except (OSError, ValueError) as error:
        raise InputError(f"{path}: is not a place to write to ({reason_of(error)}); choose another") from error
    if longest > MOST_NAME_BYTES:
        raise InputError(f"{path}: a name has {longest} bytes, {MOST_NAME_BYTES} at most are possible; shorten it")
    if len(os.fsencode(real)) > MOST_PATH_BYTES:
        raise InputError(f"{path}: the path is longer than {MOST_PATH_BYTES} bytes; choose another place")
    status_of(real)
    if os.path.islink(real):
        raise InputError(f"{path}: its links lead in a circle; choose another name")
    return real


def require_folder_for(path: Path, real: Path) -> None:
    """Raise InputError unless the folder that a path leads into is there and may be written to."""
    folder = path.parent if real.parent == Path(os.path.realpath(path.parent)) else real.parent
    if not is_folder(real.parent):
        raise InputError(f"{path}: the folder {folder} does not exist; create it or choose another")
    require_writable(path, real.parent)


def require_writable(path: Path, folder: Path) -> None:
    """Raise InputError unless this folder, on the way to `path`, may be written to."""
    if not os.access(folder, os.W_OK | os.X_OK):
        raise InputError(f"{path}: the folder {folder} may not be written to; choose another place")


def require_no_dangling_link(folder: Path, real: Path) -> None:
    """Raise InputError for a link to what is not there: a disk that is absent must not be replaced by a folder."""
    for place in (folder, *folder.parents):
        if os.path.islink(place) and status_of(place) is None and not (place == folder and is_folder(real.parent)):
            raise InputError(f"{folder}: {place} is a broken link; choose another place")


def require_no_link(path: Path, folder: Path) -> None:
    """Raise InputError where `path`, or a folder on the way to it below `folder`, is a link: what it leads to is not
    what was named.
    """
    for place in (path, *path.parents):
        if place == folder:
            return
        if os.path.islink(place):
            raise InputError(f"{place}: is a link, and nothing is written through it; remove it")


def require_outside(path: Path, real: Path, read: Path) -> None:
    """Raise InputError where an input is a folder, and `path` it or in it."""
    status = status_of(read)
    if status is not None and stat.S_ISDIR(status.st_mode) and is_within(real, status):
        raise InputError(f"{path}: lies in {read}, which is read, and nothing is written there; choose another place")


def is_within(path: Path, folder: os.stat_result) -> bool:
    """Whether a place, which need not be there, is this folder or lies in it."""
    found = (status_of(place) for place in (path, *path.parents))
    return any(status is not None and os.path.samestat(status, folder) for status in found)


def places_of(read: Path) -> Iterator[Path]:
    """Where an input lies: under the name given, under those that its links lead by, and at their end."""
    for _ in range(MOST_LINKS):
        read = Path(os.path.realpath(read.parent), read.name)
        yield read
        if not os.path.islink(read):
            break
        read = read.parent / os.readlink(read)
    yield Path(os.path.realpath(read))


def reads_file(read: Path, target: os.stat_result) -> bool:
    """Whether an input is this file or, being a folder, holds it, under whatever name."""
    status = status_of(read)
    if status is None:
        return False
    if stat.S_ISDIR(status.st_mode):
        return _folder_reads(read, target, FOLDER_LEVELS)
    return os.path.samestat(status, target)


def _folder_reads(folder: Path, target: os.stat_result, levels: int) -> bool:
    with suppress(OSError), os.scandir(folder) as entries:
        for entry in entries:
            with suppress(OSError):  # a link to nothing
                if entry.is_dir():
                    if levels > 1 and _folder_reads(Path(entry.path), target, levels - 1):
                        return True
                elif (entry.is_symlink() or entry.inode() == target.st_ino) and os.path.samestat(
                    os.stat(entry.path), target
                ):
                    return True
    return False
