"""Files on disk as they are found: what is at a path, whether it may be read, how much may come of it.

Paths come from people: what cannot be looked at is refused in one line, here, so everybody asks here (`outputs.py` for
what is written).
"""

from __future__ import annotations

import errno
import os
import stat
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import BinaryIO

from iibr_core.types import InputError

MAX_FILE_PIXELS = 400_000_000
"""No file may claim more pixels than this: a hostile header must not cost memory."""
MOST_INFLATION = 500
"""Decoded bytes for each byte of a file: pictures reach some tens, zlib at most 1032 where all is of one colour."""
HARMLESS_BYTES = 256 * 2**20
"""Whatever the file's size, so much may be decoded from it."""
MOST_TEXT_BYTES = 1 << 20
"""Of settings and lists: no such file is larger."""

NOTHING_THERE = (errno.ENOENT, errno.ENOTDIR, errno.ELOOP, errno.ENAMETOOLONG)
MOST_REASON_CHARACTERS = 200
SPECIAL_FILES = (
    (stat.S_ISFIFO, "a pipe"),
    (stat.S_ISSOCK, "a socket"),
    (stat.S_ISCHR, "a device"),
    (stat.S_ISBLK, "a device"),
)
MOST_SHOWN_CHARACTERS = 80


def reason_of(failure: Exception | str) -> str:
    """Why a file could not be read or written, for the brackets in an InputError: the first line of what a library
    says, the start of it. Where it says nothing: the kind of the exception, else that no reason is given.
    """
    lines = [" ".join(line.split()) for line in str(failure).splitlines()]
    said = next((line for line in lines if line), "")
    if said:
        return said[:MOST_REASON_CHARACTERS]
    return type(failure).__name__ if isinstance(failure, Exception) else "no reason given"


def shown_name(name: str) -> str:
    """A file's name for people and for files of UTF-8: bytes in it that are no text become the sign for that."""
    return os.fsencode(name).decode("utf-8", "replace")


def printable(text: str) -> str:
    """The start of a text that came out of a file, for a message: one line, without control characters."""
    line = "".join(character if character.isprintable() else "?" for character in text)
    return line if len(line) <= MOST_SHOWN_CHARACTERS else f"{line[: MOST_SHOWN_CHARACTERS - 3]}..."


def status_of(path: Path) -> os.stat_result | None:
    """What is at `path`, links followed; None where nothing is, or nothing can be of such a name.

    Raises InputError where that may not be known, as below a folder without search permission.
    """
    try:
        return os.stat(path)
    except ValueError:  # a NUL in the name
        return None
    except OSError as error:
        if error.errno in NOTHING_THERE:
            return None
        raise InputError(
            f"{path}: cannot be looked at ({error.strerror or error}); change the permissions of its folders"
        ) from error


def is_file(path: Path) -> bool:
    """Whether there is an ordinary file. Raises InputError as `status_of` does."""
    status = status_of(path)
    return status is not None and stat.S_ISREG(status.st_mode)


def is_folder(path: Path) -> bool:
    """Whether there is a folder. Raises InputError as `status_of` does."""
    status = status_of(path)
    return status is not None and stat.S_ISDIR(status.st_mode)


def ordinary_file(path: Path) -> Path | None:
    """The path where an ordinary file is, None where nothing is. It is not opened.

    Raises InputError where a link, a folder, a device or the like is.
    """
    try:
        status = os.lstat(path)
    except (OSError, ValueError) as error:  # ValueError: no name of a file
        if isinstance(error, ValueError) or error.errno in NOTHING_THERE:
            return None
        raise InputError(f"{path}: cannot be looked at ({error.strerror or error})") from error
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"{path}: is a link, a folder or a device; put an ordinary file there, or nothing")
    return path


def file_within(folder: Path, name: str) -> Path | None:
    """The ordinary file of a plain name in a folder; None where the name leads elsewhere or no such file is. For names
    that come out of a file.
    """
    if name in ("", ".", "..") or not name == PurePosixPath(name).name == PureWindowsPath(name).name:
        return None
    try:
        return ordinary_file(folder / name)
    except InputError:
        return None


def stays_within(name: str) -> bool:
    """Whether a path that comes out of a file, joined to a folder, cannot lead out of it by its words."""
    windows = PureWindowsPath(name)
    return not (PurePosixPath(name).is_absolute() or windows.drive or windows.root or ".." in windows.parts)


def entries_of(folder: Path) -> list[Path]:
    """What lies in a folder, by name. Raises InputError where it cannot be listed."""
    try:
        return sorted(folder.iterdir())
    except OSError as error:
        raise InputError(f"{folder}: cannot be read ({error.strerror or error}); change its permissions") from error


def require_file(path: Path) -> None:
    """Raise InputError unless `path` is a readable file with something in it."""
    status = status_of(path)
    if status is not None and stat.S_ISDIR(status.st_mode):
        raise InputError(f"{path}: is a folder, not a file")
    if status is None:
        raise InputError(f"{path}: no such file")
    if not stat.S_ISREG(status.st_mode):
        kind = next((name for is_kind, name in SPECIAL_FILES if is_kind(status.st_mode)), "no ordinary file")
        raise InputError(f"{path}: is {kind}, not an ordinary file; copy its content into one")
    if status.st_size == 0:
        raise InputError(f"{path}: the file is empty (0 bytes)")
    if not os.access(path, os.R_OK):
        raise InputError(f"{path}: may not be read; change its permissions")


@contextmanager
def open_binary(path: Path) -> Iterator[BinaryIO]:
    """The file, open for reading bytes.

    Raises InputError as `require_file` does, and where the file goes away or fails while it is read.
    """
    require_file(path)
    try:
        with open(path, "rb", opener=_open_at_once) as file:
            yield file
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}); is it still there?") from error


def read_text(path: Path, most_bytes: int = MOST_TEXT_BYTES) -> str:
    """What a text file holds; a byte order mark goes, what is no UTF-8 becomes the sign for that.

    Raises InputError as `open_binary` does, and for a file of more bytes.
    """
    with open_binary(path) as file:
        data = file.read(most_bytes + 1)
    if len(data) > most_bytes:
        raise InputError(f"{path}: is larger than {most_bytes:,} bytes, as no such text is; get the right file")
    return data.decode("utf-8-sig", "replace")


def _open_at_once(path: str, flags: int) -> int:
    """A descriptor; a pipe that took the file's place meanwhile is not waited for."""
    return os.open(path, flags | getattr(os, "O_NONBLOCK", 0))


def refuse_bomb(path: Path, decoded_bytes: int) -> None:
    """Raise InputError for a small file that claims to hold a huge picture, before any of it is decoded."""
    stored = path.stat().st_size
    if decoded_bytes > max(HARMLESS_BYTES, MOST_INFLATION * stored):
        raise InputError(
            f"{path}: its {stored:,} bytes claim to hold {decoded_bytes / 2**20:,.0f} MiB, as no photo does;"
            " save it again, smaller"
        )
