"""Check where an output may go, write it beside its place, and rename it when it is whole.

Inputs are never overwritten; an output that exists is replaced only where that is allowed. Links are followed.
"""

import os
import platform
import re
import shutil
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from glob import escape
from pathlib import Path
from tempfile import TemporaryDirectory

import psutil

from iibr_core.formats.files import reason_of
from iibr_core.remedies import FixableError, Remedy, remedy_of
from iibr_core.types import InputError

TEMPORARY = f".iibr-{platform.node()}-"
"""Start of the names of unfinished outputs of this machine; the number of the process follows."""


class AlreadyThereError(FixableError):
    """The output exists, and may not be replaced."""

    def __init__(self, message: str) -> None:
        super().__init__(message, Remedy.REPLACE)


def check_output(path: Path, inputs: Iterable[Path] = (), may_replace: bool = False) -> None:
    """Raise InputError unless a file may be written to `path`. inputs: files and folders that are read.

    Raises AlreadyThereError where it exists and may_replace is false.
    """
    real = _resolve(path)
    if real.is_dir():
        raise InputError(f"{path}: is a folder, not a file; name a file in it")
    if not real.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; create it or choose another")
    _require_writable(path, real.parent)
    _require_outside(path, real, inputs)
    if real.exists() and not real.is_file():
        raise InputError(f"{path}: is a device or a pipe; give the name of a file")
    if real.exists() and not may_replace:
        raise AlreadyThereError(f"{path}: already exists")


def check_output_folder(
    folder: Path, inputs: Iterable[Path] = (), may_replace: bool = False, own_files: str | None = None
) -> None:
    """Raise InputError unless a folder may be made or written to. inputs: files and folders that are read.

    own_files: regular expression of the paths in it that this program writes; a folder with others is refused, also
    with may_replace, because it would be replaced as a whole. None: files are added to the folder. Raises
    AlreadyThereError where it is not empty and may_replace is false.
    """
    real = _resolve(folder)
    above = next(place for place in (real, *real.parents) if place.exists())
    if not above.is_dir():
        raise FixableError(f"{folder}: {above} is a file, not a folder", Remedy.PLACE)
    _require_writable(folder, above)
    inputs = tuple(inputs)
    _require_outside(folder, real, inputs)
    for read in inputs:
        if real in _resolve(read).parents:
            raise InputError(f"{folder}: holds the input {read}, which is never overwritten; choose another folder")
    if real.is_dir() and not may_replace and any(real.iterdir()):
        raise AlreadyThereError(f"{folder}: already exists")
    if own_files is not None and real.is_dir():
        _require_own_files(folder, real, own_files)


def make_folder(folder: Path) -> None:
    """Make a folder, and those above it, where there is none."""
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise FixableError(f"{folder}: cannot be created ({reason_of(error)})", Remedy.PLACE) from error


def remove_leftovers(folder: Path) -> None:
    """Remove the unfinished outputs that killed processes of this machine left in a folder."""
    for path in folder.glob(f"{escape(TEMPORARY)}*"):
        number = path.name.removeprefix(TEMPORARY).partition("-")[0]
        if number.isdecimal() and not psutil.pid_exists(int(number)):
            shutil.rmtree(path, ignore_errors=True)


@contextmanager
def write_file(path: Path) -> Iterator[Path]:
    """Yield the name of a file to write, in a hidden folder beside `path`; it is renamed when the block ends well."""
    real = _resolve(path)
    if not real.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; create it or choose another")
    with _beside(path, real) as scratch:
        unfinished = scratch / real.name
        yield unfinished
        unfinished.replace(real)


@contextmanager
def write_folder(folder: Path) -> Iterator[Path]:
    """Yield an empty folder to fill; it replaces `folder` when the block ends well. Folders above it are made."""
    real = _resolve(folder)
    make_folder(real.parent)
    with _beside(folder, real) as scratch:
        unfinished = scratch / "new" / real.name
        unfinished.mkdir(parents=True)
        yield unfinished
        _exchange(unfinished, real, scratch / "old")


@contextmanager
def _beside(path: Path, real: Path) -> Iterator[Path]:
    """Yield a hidden temporary folder beside an output. Errors that name files in it name the output instead."""
    remove_leftovers(real.parent)
    prefix = f"{TEMPORARY}{os.getpid()}-"
    try:
        with TemporaryDirectory(dir=real.parent, prefix=prefix, ignore_cleanup_errors=True) as scratch:
            yield Path(scratch)
    except InputError as error:
        message = str(error)
        if TEMPORARY not in message:
            raise
        raise FixableError(f"{path}: {message.partition(': ')[2]}", remedy_of(error)) from error
    except OSError as error:
        raise FixableError(f"{path}: cannot be written ({reason_of(error)})", Remedy.PLACE) from error


def _exchange(new: Path, place: Path, old: Path) -> None:
    """Rename `place` to `old`, and `new` to `place`; where that fails, the old folder comes back."""
    if place.exists():
        place.rename(old)
    try:
        new.rename(place)
    except OSError:
        if old.exists():
            old.rename(place)
        raise


def _resolve(path: Path) -> Path:
    try:
        return path.resolve()
    except (OSError, ValueError, RuntimeError) as error:  # a loop of links, a NUL in the name
        raise InputError(f"{path}: is no place to write to ({reason_of(error)}); choose another") from error


def _require_writable(path: Path, folder: Path) -> None:
    if not os.access(folder, os.W_OK | os.X_OK):
        raise FixableError(f"{path}: the folder {folder} may not be written to", Remedy.PLACE)


def _require_outside(path: Path, real: Path, inputs: Iterable[Path]) -> None:
    """Raise InputError where a place is an input, or lies in one."""
    for read in inputs:
        if read.exists() and real.exists() and real.samefile(read):
            raise InputError(f"{path}: is an input ({read}), which is never overwritten; choose another name")
        if read.is_dir() and _resolve(read) in (real, *real.parents):
            raise FixableError(f"{path}: lies in the input {read}, where nothing is written", Remedy.PLACE)


def _require_own_files(folder: Path, real: Path, own_files: str) -> None:
    for place, _, names in os.walk(real):
        for name in names:
            inside = (Path(place) / name).relative_to(real).as_posix()
            if not re.fullmatch(own_files, inside):
                raise InputError(f"{folder}: holds other files ({name}); choose an empty or new folder")
