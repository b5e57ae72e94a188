"""Files on disk: there before they are read; written whole or not at all (under another name, then renamed)."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import BinaryIO
from uuid import uuid4

from iibr_core.types import InputError

MAX_FILE_PIXELS = 400_000_000
"""No file may claim more pixels than this: a hostile header must not cost memory."""
MOST_INFLATION = 500
"""Decoded bytes for each byte of a file: pictures reach some tens, zlib at most 1032 where all is of one colour."""
HARMLESS_BYTES = 256 * 2**20
"""Whatever the file's size, so much may be decoded from it."""


MOST_REASON_CHARACTERS = 200


def reason_of(failure: Exception | str) -> str:
    """Why a file could not be read or written, for the brackets in an InputError: the first line of what a library
    says, the start of it. Where it says nothing: the kind of the exception, else that no reason is given.
    """
    lines = [" ".join(line.split()) for line in str(failure).splitlines()]
    said = next((line for line in lines if line), "")
    if said:
        return said[:MOST_REASON_CHARACTERS]
    return type(failure).__name__ if isinstance(failure, Exception) else "no reason given"


def temporary_sibling(path: Path) -> Path:
    """An unused name in the folder of `path`, with its extension (writers choose the format by it)."""
    return path.with_name(f".{path.stem}.{uuid4().hex[:12]}{path.suffix}")


def require_folder_of(path: Path) -> None:
    """Raise InputError unless there is a folder for `path` to be written into."""
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; create it or choose another")


@contextmanager
def atomic_write(path: Path) -> Iterator[Path]:
    """Yield the temporary name to write to; it takes the place of `path` when the block ends well, else it is removed.

    Raises InputError where the folder is missing, is no folder, or may not be written to.
    """
    require_folder_of(path)
    temporary = temporary_sibling(path)
    try:
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror or error}); choose another place") from error
    finally:
        temporary.unlink(missing_ok=True)


def require_file(path: Path) -> None:
    """Raise InputError unless `path` is a readable file with something in it."""
    if path.is_dir():
        raise InputError(f"{path}: is a folder, not a file")
    if not path.is_file():
        raise InputError(f"{path}: no such file")
    if path.stat().st_size == 0:
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
        with path.open("rb") as file:
            yield file
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror or error}); is it still there?") from error


def refuse_bomb(path: Path, decoded_bytes: int) -> None:
    """Raise InputError for a small file that claims to hold a huge picture, before any of it is decoded."""
    stored = path.stat().st_size
    if decoded_bytes > max(HARMLESS_BYTES, MOST_INFLATION * stored):
        raise InputError(
            f"{path}: its {stored:,} bytes claim to hold {decoded_bytes / 2**20:,.0f} MiB, as no photo does;"
            " save it anew, smaller"
        )
