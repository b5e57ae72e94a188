"""Files and folders that are written: where they may go, and that they come there whole or not at all.

Nothing is ever written onto, into or over what is read; over other things only where that was allowed. Links are
followed. A place that was free when it was asked for is taken only while it still is. What is not finished lies beside
its place under a short hidden name, see `unfinished`.
"""

from __future__ import annotations

import errno
import os
import re
import stat
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from iibr_core.formats.files import entries_of, is_folder, status_of
from iibr_core.formats.places import (
    is_within,
    places_of,
    reads_file,
    real_place,
    require_folder_for,
    require_no_dangling_link,
    require_outside,
    require_writable,
)
from iibr_core.formats.unfinished import (
    CLAIMS,
    NEW,
    OLD,
    TEMPORARY_NAME,
    make_temporary,
    remove_around,
    remove_leftovers,
    unlock,
)
from iibr_core.types import InputError

TAKEN = (errno.EEXIST, errno.ENOTEMPTY, errno.ENOTDIR)
"""What a folder's place says where something is there."""


class AlreadyThereError(InputError):
    """There is something under this name, and nobody said that it may go."""


def require_file_place(path: Path, inputs: Iterable[Path] = (), may_replace: bool = False) -> None:
    """Raise InputError unless a file may be written to `path`: its folder is there and may be written to, and no input
    is it or holds it. AlreadyThereError where there is one that may not be replaced.

    inputs: files and folders that are read.
    """
    real = real_place(path)
    require_folder_for(path, real)
    remove_leftovers(real.parent)
    status = status_of(real)
    if status is not None and stat.S_ISDIR(status.st_mode):
        raise InputError(f"{path}: is a folder, not a file; name a file in it")
    if status is not None and not stat.S_ISREG(status.st_mode):
        raise InputError(f"{path}: is a device or a pipe; give the name of a file")
    for read in inputs:
        require_outside(path, real, read)
        if status is not None and reads_file(read, status):
            raise InputError(f"{path}: is read here ({read}), and no input is overwritten; choose another name")
    if status is not None and not may_replace:
        raise AlreadyThereError(f"{path}: already exists; give --force to replace it, or choose another name")
    _claim_place(real, may_replace)


def require_folder_place(
    folder: Path, inputs: Iterable[Path] = (), may_replace: bool = False, is_whole: bool = False
) -> None:
    """Raise InputError unless a folder may be written to: it can be made or is one, and no input is it, holds it or
    lies in it. AlreadyThereError where something lies in it and it may not be replaced.

    inputs: files and folders that are read. is_whole: whether all of it is replaced, not files in it.
    """
    real = real_place(folder)
    remove_leftovers(real.parent if is_whole else real)
    _require_possible_folder(folder, real, is_whole)
    status = status_of(real)
    for read in inputs:
        require_outside(folder, real, read)
        if status is not None and any(is_within(place.parent, status) for place in places_of(read)):
            raise InputError(f"{folder}: holds {read}, which is read, and no input is overwritten; choose another")
    if status is not None and is_whole and os.path.ismount(real):
        raise InputError(f"{folder}: a disk is mounted there; name a folder in it")
    if status is not None and not may_replace and entries_of(real):
        raise AlreadyThereError(f"{folder}: already exists; give --force to replace it, or choose another folder")
    if is_whole:
        _claim_place(real, may_replace)


def _require_possible_folder(folder: Path, real: Path, is_whole: bool) -> None:
    """Raise InputError where no folder is and none can be made, or may not be written to."""
    require_no_dangling_link(folder, real)
    status = status_of(real)
    if status is not None and not stat.S_ISDIR(status.st_mode):
        raise InputError(f"{folder}: is a file, not a folder; choose another name")
    above = real.parent if is_whole else real
    there = next(place for place in (above, *above.parents) if os.path.lexists(place))
    if not is_folder(there):
        raise InputError(f"{folder}: {there} is a file, not a folder; choose another place")
    require_writable(folder, there)


def require_own_folder(folder: Path, own_files: str) -> None:
    """Raise InputError where a folder holds anything but what was written there before, which matches a regular
    expression by its path in it: it would be replaced as a whole.
    """
    if not is_folder(folder):
        return
    remove_leftovers(folder)
    for place, _, names in os.walk(folder):
        for name in names:
            if not re.fullmatch(own_files, (Path(place) / name).relative_to(folder).as_posix()):
                raise InputError(f"{folder}: holds other files ({name}); choose an empty or new folder")


def require_files_in(
    folder: Path, names: Iterable[str], inputs: Iterable[Path] = (), may_replace: bool = False
) -> None:
    """Raise as `require_folder_place` does, and as `require_file_place` for what already exists of the files that a
    folder is to hold.
    """
    inputs = tuple(inputs)
    require_folder_place(folder, inputs, may_replace)
    for name in names:
        if is_folder(folder):
            require_file_place(folder / name, inputs, may_replace)
        else:
            _claim_place(real_place(folder / name), may_replace)


def open_to_append(path: Path) -> int:
    """A descriptor to read an ordinary file and to add to it; it is made where there is none.

    Raises InputError for anything else, for links, and for a file with several names: what it leads to is not what was
    named.
    """
    status = None
    with suppress(OSError):
        status = os.lstat(path)
    _require_single_file(path, status)
    here = (getattr(os, name, 0) for name in ("O_NOFOLLOW", "O_NONBLOCK", "O_BINARY"))  # the last: on Windows
    try:
        descriptor = os.open(path, sum(here, os.O_RDWR | os.O_APPEND | os.O_CREAT), 0o666)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error}); choose another place") from error
    try:
        _require_single_file(path, os.fstat(descriptor))
    except InputError:
        os.close(descriptor)
        raise
    return descriptor


def _require_single_file(path: Path, status: os.stat_result | None) -> None:
    if status is not None and (not stat.S_ISREG(status.st_mode) or status.st_nlink > 1):
        raise InputError(f"{path}: is a link or not an ordinary file, so it is not overwritten; remove it")


def make_folder(folder: Path) -> None:
    """Make a folder, and those above it, where there is none; links are followed. Raises InputError."""
    try:
        real_place(folder).mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"{folder}: cannot be created ({error.strerror or error}); choose another place") from error


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield the temporary name to write to; it takes the place of `path` when the block ends well, else it is removed.

    The temporary file is there, empty, with the extension of `path`. Raises InputError where the folder is missing, is
    no folder, or may not be written to.
    """
    real = real_place(path)
    require_folder_for(path, real)
    if not any(map(TEMPORARY_NAME.fullmatch, real.parts)):  # else once for every view of a light field
        remove_leftovers(real.parent)
    suffix = real.suffix if TEMPORARY_NAME.fullmatch(f".iibr-{'0' * 16}{real.suffix}") else ""
    temporary, lock = None, None
    try:
        temporary, lock = make_temporary(real.parent, lambda new: new.touch(exist_ok=False), suffix)
        yield temporary
        _put_file(temporary, real)
    except FileExistsError as error:
        raise AlreadyThereError(_taken(path)) from error
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error}); choose another place") from error
    finally:
        if temporary is not None:
            with suppress(OSError):
                temporary.unlink(missing_ok=True)
        unlock(lock)


class UnfinishedFolder:
    """A folder on its way to its place: write to `path`, then call `put_in_place`; `discard` in any case at the end.

    Folders above it are made where they are missing.
    """

    def __init__(self, folder: Path) -> None:
        """Raises InputError where it cannot be made."""
        self.folder = folder
        self._real = real_place(folder)
        _require_possible_folder(folder, self._real, is_whole=True)
        self._made_parents = [parent for parent in self._real.parents if not os.path.lexists(parent)]
        self._around: Path | None = None
        self._lock: int | None = None
        try:
            self._real.parent.mkdir(parents=True, exist_ok=True)
            remove_leftovers(self._real.parent)
            self._around, self._lock = make_temporary(self._real.parent, Path.mkdir)
            self.path = self._around / NEW / self._real.name
            self.path.mkdir(parents=True)
        except BaseException as error:
            self.discard()
            if not isinstance(error, OSError):
                raise
            raise InputError(
                f"{folder}: cannot be created ({error.strerror or error}); choose another place"
            ) from error

    def put_in_place(self) -> None:
        """Replace what is there by it. Raises InputError where that cannot be, AlreadyThereError where the place was
        free and must not be replaced; then what was there stays.
        """
        assert self._around is not None
        try:
            if self._real in CLAIMS:
                with suppress(FileNotFoundError):
                    self._real.rmdir()
            elif os.path.lexists(self._real):
                # Under its own name, and it is known where it belongs, should this process be killed now.
                (self._around / OLD).mkdir()
                self._real.rename(self._around / OLD / self._real.name)
            self.path.rename(self._real)
            CLAIMS.release(self._real)
        except OSError as error:
            if self._real in CLAIMS and error.errno in TAKEN:
                raise AlreadyThereError(_taken(self.folder)) from error
            raise InputError(
                f"{self.folder}: cannot be replaced ({error.strerror or error}); choose another place"
            ) from error

    def discard(self) -> None:
        """Remove what is temporary, and folders made for it; what was moved aside and not replaced comes back."""
        if self._around is not None:
            with suppress(OSError):
                remove_around(self._around)
        unlock(self._lock)
        self._lock = None
        for parent in self._made_parents:
            with suppress(OSError):  # not empty: the folder is in it
                parent.rmdir()


def release_place(path: Path) -> None:
    """Nothing will be written there after all: others may. Nothing happens where it was written."""
    with suppress(InputError):
        CLAIMS.release(real_place(path))


def _claim_place(real: Path, may_replace: bool) -> None:
    """What is written there must not replace anything, unless it may."""
    if may_replace:
        CLAIMS.release(real)
    else:
        CLAIMS.take(real)


def _put_file(temporary: Path, real: Path) -> None:
    """Rename a file to its place. Raises FileExistsError where that is taken and must not be replaced."""
    if real in CLAIMS:
        try:
            os.link(temporary, real)
        except FileExistsError:
            raise
        except OSError:  # a file system without hard links
            real.open("xb").close()
            temporary.replace(real)
        CLAIMS.release(real)
    else:
        temporary.replace(real)


def _taken(path: Path) -> str:
    return f"{path}: another program has written it meanwhile, and it is kept; choose another name"
