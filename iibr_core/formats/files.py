"""Look at files and read them, with limits: paths come from people, and contents from anywhere."""

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
"""Largest text file that is read: settings and lists are smaller."""

NOTHING_THERE = (errno.ENOENT, errno.ENOTDIR, errno.ELOOP, errno.ENAMETOOLONG)
MOST_REASON_CHARACTERS = 200
MOST_SHOWN_CHARACTERS = 80


def reason_of(failure: Exception | str) -> str:
    """Return why something failed, for the brackets in an InputError: the start of a library's message, in one line."""
    if isinstance(failure, OSError) and failure.strerror:
        return failure.strerror
    lines = [" ".join(line.split()) for line in str(failure).splitlines()]
    message = next((line for line in lines if line), "")
    if message:
        return message[:MOST_REASON_CHARACTERS]
    return type(failure).__name__ if isinstance(failure, Exception) else "no reason given"


def printable(text: str) -> str:
    """Return the start of a text from a file, for a message: one line, without control characters."""
    line = "".join(character if character.isprintable() else "?" for character in text)
    return line if len(line) <= MOST_SHOWN_CHARACTERS else f"{line[: MOST_SHOWN_CHARACTERS - 3]}..."


def status_of(path: Path) -> os.stat_result | None:
    """Return the status of a file or folder, links followed; None where there is nothing.

    Raises InputError where permissions hide it, as below a folder without search permission.
    """
    try:
        return os.stat(path)
    except ValueError:  # a NUL in the name
        return None
    except OSError as error:
        if error.errno in NOTHING_THERE:
            return None
        raise InputError(
            f"{path}: cannot be looked at ({reason_of(error)}); change the permissions of its folders"
        ) from error


def is_file(path: Path) -> bool:
    """Whether there is an ordinary file. Raises InputError as `status_of` does."""
    status = status_of(path)
    return status is not None and stat.S_ISREG(status.st_mode)


def is_folder(path: Path) -> bool:
    """Whether there is a folder. Raises InputError as `status_of` does."""
    status = status_of(path)
    return status is not None and stat.S_ISDIR(status.st_mode)


def stays_within(name: str) -> bool:
    """Whether a path that comes out of a file, joined to a folder, cannot lead out of it by its words."""
    windows = PureWindowsPath(name)
    return not (PurePosixPath(name).is_absolute() or windows.drive or windows.root or ".." in windows.parts)


def entries_of(folder: Path) -> list[Path]:
    """Return all in a folder, by name. Raises InputError where it cannot be listed."""
    try:
        return sorted(folder.iterdir())
    except OSError as error:
        raise InputError(f"{folder}: cannot be read ({reason_of(error)}); change its permissions") from error


def require_file(path: Path) -> None:
    """Raise InputError unless `path` is a readable file with something in it."""
    status = status_of(path)
    if status is None:
        raise InputError(f"{path}: no such file")
    if stat.S_ISDIR(status.st_mode):
        raise InputError(f"{path}: is a folder, not a file")
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"{path}: is a pipe or a device, not an ordinary file; copy its content into one")
    if status.st_size == 0:
        raise InputError(f"{path}: the file is empty (0 bytes)")
    if not os.access(path, os.R_OK):
        raise InputError(f"{path}: may not be read; change its permissions")


@contextmanager
def open_binary(path: Path) -> Iterator[BinaryIO]:
    """Open a file to read its bytes. Raises InputError as `require_file` does, and where reading fails."""
    require_file(path)
    try:
        with path.open("rb") as file:
            yield file
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({reason_of(error)}); is it still there?") from error


def read_text(path: Path, most_bytes: int = MOST_TEXT_BYTES) -> str:
    """Read a text file; a byte order mark goes, bytes that are no UTF-8 become the sign for that.

    Raises InputError as `open_binary` does, and for a file of more bytes.
    """
    with open_binary(path) as file:
        data = file.read(most_bytes + 1)
    if len(data) > most_bytes:
        raise InputError(f"{path}: is larger than {most_bytes:,} bytes, as no such text is; get the right file")
    return data.decode("utf-8-sig", "replace")


def refuse_bomb(path: Path, decoded_bytes: int) -> None:
    """Raise InputError for a small file that claims to hold a huge picture, before any of it is decoded."""
    stored = path.stat().st_size
    if decoded_bytes > max(HARMLESS_BYTES, MOST_INFLATION * stored):
        raise InputError(
            f"{path}: its {stored:,} bytes claim to hold {decoded_bytes / 2**20:,.0f} MiB, as no photo does;"
            " save it again, smaller"
        )
