"""Look at files and read them, with limits: paths come from people, and contents from anywhere."""

import os
import re
import stat
import struct
import tokenize
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath, PureWindowsPath
from typing import BinaryIO

from iibr_core.types import InputError

MAX_FILE_PIXELS = 400_000_000
"""Largest number of pixels that a file may claim: a hostile header must not cost memory."""
MAX_INFLATION = 500
"""Largest number of decoded bytes for each byte of a file: pictures reach some tens, zlib at most 1032."""
HARMLESS_BYTES = 256 * 2**20
"""Number of bytes that may be decoded from a file of any size."""
MAX_FILE_BYTES = 1 << 30
"""Number of bytes that are read of a file as a whole."""
MAX_PART_BYTES = 64 << 20
"""Size of the largest part of a file that is parsed: a packet of XMP, a picture in an archive, a list of cameras."""
MAX_TEXT_BYTES = 1 << 20
"""Size of the largest text file that is read: settings and lists are smaller."""
PARSE_ERRORS = (
    ValueError, TypeError, LookupError, ArithmeticError, AttributeError, RuntimeError, OSError, EOFError, SyntaxError,
    MemoryError, struct.error, zlib.error, zipfile.BadZipFile, tokenize.TokenError,
)  # fmt: skip
"""Errors of the parsers of other projects, and of ours, for damaged files."""
COPY = r"(?:(?: ?[-_])? ?\(?(?:copy|kopie|copie|copia)(?: ?\d{1,4})?\)?| ?\(\d{1,4}\))*"
"""Pattern of what browsers and file managers add to the stem of a copy: " (1)", " - Copy", "_copy"; ignores case."""
UNSUPPORTED = re.compile(r"unsupported|not (?:supported|implemented|configured)", re.IGNORECASE)
"""Words of decoders about files that are whole, but of a kind that they do not know."""
SAVE_ELSEWHERE = "if another program opens it, save it there as JPEG, PNG or TIFF"
MAX_REASON_CHARACTERS = 200
MAX_SHOWN_CHARACTERS = 80


def reason_of(failure: Exception | str) -> str:
    """Return why something failed, for the brackets in an InputError: the start of a library's message, in one line."""
    if isinstance(failure, OSError) and failure.strerror:
        return failure.strerror
    text = f"no {failure}" if isinstance(failure, KeyError) else str(failure)
    lines = (" ".join(line.split()) for line in text.splitlines())
    name = type(failure).__name__ if isinstance(failure, Exception) else "no reason given"
    return next(filter(None, lines), name)[:MAX_REASON_CHARACTERS]


@contextmanager
def parsing(name: object, fault: str, errors: tuple[type[Exception], ...] = PARSE_ERRORS) -> Iterator[None]:
    """Raise InputError for these errors in the block: a file's name and fault, where {} stands for the reason."""
    try:
        yield
    except InputError:
        raise
    except errors as error:
        raise InputError(f"{name}: {fault.format(reason_of(error))}") from error


def decoding_fault(failure: Exception | str, is_opened: bool = True) -> str:
    """Return the end of an error about a picture that a decoder refuses: it is damaged, or of a kind that is not read.

    is_opened: whether the decoder understood the header.
    """
    reason = reason_of(failure)
    if UNSUPPORTED.search(reason):
        return f"cannot be read as a picture ({reason}); {SAVE_ELSEWHERE}"
    if is_opened:
        return f"damaged or cut off ({reason}); get the whole file again"
    return f"cannot be read as a picture ({reason}); get the whole file again, or, {SAVE_ELSEWHERE}"


def printable(text: str) -> str:
    """Return the start of a text from a file, for a message: one line, without control characters."""
    line = "".join(character if character.isprintable() else "?" for character in text)
    return line if len(line) <= MAX_SHOWN_CHARACTERS else f"{line[: MAX_SHOWN_CHARACTERS - 3]}..."


def stays_within(name: str) -> bool:
    """Return whether a path from a file, joined to a folder, cannot lead out of it by its words."""
    windows = PureWindowsPath(name)
    return not (PurePosixPath(name).is_absolute() or windows.drive or windows.root or ".." in windows.parts)


def entries_of(folder: Path) -> list[Path]:
    """Return all in a folder, by name, but hidden files, such as those that macOS adds to foreign disks (`._a.png`)."""
    try:
        return sorted(path for path in folder.iterdir() if not path.name.startswith("."))
    except OSError as error:
        raise InputError(f"{folder}: cannot be read ({reason_of(error)}); change its permissions") from error


def require_file(path: Path) -> None:
    """Raise InputError unless `path` is a readable file with something in it."""
    try:
        status = path.stat()
    except (FileNotFoundError, NotADirectoryError, ValueError) as error:  # ValueError: a NUL in the name
        raise InputError(f"{path}: no such file") from error
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({reason_of(error)}); choose another") from error
    if stat.S_ISDIR(status.st_mode):
        raise InputError(f"{path}: is a folder, not a file")
    if not stat.S_ISREG(status.st_mode):
        raise InputError(f"{path}: is a pipe or a device, not an ordinary file; copy its content into one")
    if status.st_size == 0:
        raise InputError(f"{path}: the file is empty (0 bytes)")
    if not os.access(path, os.R_OK):
        raise InputError(f"{path}: may not be read; change its permissions")


def stamp_of(path: Path) -> tuple[int, ...]:
    """Return a stamp that changes with the file. Raises InputError as `require_file` does."""
    require_file(path)
    status = path.stat()
    return status.st_ino, status.st_size, status.st_mtime_ns


@contextmanager
def open_binary(path: Path) -> Iterator[BinaryIO]:
    """Open a file to read its bytes. Raises InputError as `require_file` does, and where reading fails."""
    require_file(path)
    try:
        with path.open("rb") as file:
            yield file
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({reason_of(error)}); is it still there?") from error


def read_bytes(path: Path, max_bytes: int = MAX_FILE_BYTES) -> bytes:
    """Return the first bytes of a file, all of them if there are no more. Raises InputError as `open_binary` does."""
    with open_binary(path) as file:
        return file.read(max_bytes)


def read_text(path: Path, max_bytes: int = MAX_TEXT_BYTES) -> str:
    """Read a text file of at most `max_bytes`, without its byte order mark; other bytes than UTF-8 become U+FFFD."""
    data = read_bytes(path, max_bytes + 1)
    if len(data) > max_bytes:
        raise InputError(f"{path}: is larger than {max_bytes:,} bytes, as no such text is; get the right file")
    return data.decode("utf-8-sig", "replace")


def refuse_bomb(path: Path, decoded_bytes: int) -> None:
    """Raise InputError for a small file that claims to hold a huge picture, before any of it is decoded."""
    stored = path.stat().st_size
    if decoded_bytes > max(HARMLESS_BYTES, MAX_INFLATION * stored):
        raise InputError(
            f"{path}: its {stored:,} bytes claim to hold {decoded_bytes / 2**20:,.0f} MiB, as no photo does;"
            " save it again, smaller"
        )


def natural_key(path: Path) -> list[tuple[int, str]]:
    """Return a key that sorts paths by name, numbers by their value."""
    parts = re.split(r"(\d+)", path.stem.casefold())
    return [(int(part), "") if part.isdecimal() else (0, part) for part in parts]
