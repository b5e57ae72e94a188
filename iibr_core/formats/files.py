"""Files on disk: there before they are read; written whole or not at all (under another name, then renamed)."""

from __future__ import annotations

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from uuid import uuid4

from iibr_core.types import InputError


def temporary_sibling(path: Path) -> Path:
    """An unused name in the folder of `path`, with its extension (writers choose the format by it)."""
    return path.with_name(f".{path.stem}.{uuid4().hex[:12]}{path.suffix}")


@contextmanager
def written_whole(path: Path) -> Iterator[Path]:
    """Yield the temporary name to write to; it takes the place of `path` when the block ends well, else it is removed.

    Raises InputError where the folder is missing, is no folder, or may not be written to.
    """
    if not path.parent.is_dir():
        raise InputError(f"{path}: the folder {path.parent} does not exist; create it or choose another")
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
