"""Paths that a later start of the program hands over to the open window: the address of the window, and the message."""

from __future__ import annotations

import getpass
import json
import os
import sys
from collections.abc import Sequence
from urllib.parse import quote

from platformdirs import user_runtime_path

MAX_PATHS = 32
MAX_BYTES = 1 << 20
"""Largest message, in bytes: more than MAX_PATHS of the longest paths need."""
TAKEN = b"taken"
"""Answer of a window that opens the paths."""


def window_address() -> str | None:
    """Return the address of this user's window on this display; None without a folder that is the user's alone."""
    if sys.platform == "win32":
        return rf"\\.\pipe\iibr-{getpass.getuser()}"
    display = os.environ.get("DISPLAY") or os.environ.get("WAYLAND_DISPLAY") or ""
    try:
        folder = user_runtime_path("iibr", appauthor=False, ensure_exists=True)
        if {folder.lstat().st_uid, folder.parent.lstat().st_uid} != {os.getuid()}:
            return None
        folder.chmod(0o700)
    except OSError:
        return None
    return str(folder / f"window{quote(display, safe='')}")


def message_from_paths(paths: Sequence[str]) -> bytes:
    """Return the message with these absolute paths; the window opens one, so many need not be sent."""
    return json.dumps(paths[:MAX_PATHS]).encode()


def paths_from_message(message: bytes) -> tuple[str, ...] | None:
    """Return the paths in a message, None if it is none: it may come from any program of the user."""
    try:
        paths = json.loads(message)
        are_paths = all(os.path.isabs(path) and b"\0" not in os.fsencode(path) for path in paths)
    except (ValueError, TypeError, RecursionError):
        return None
    return tuple(paths) if are_paths and isinstance(paths, list) and len(paths) <= MAX_PATHS else None
