"""Paths that a later start of the program hands over to the open window: the address, the sender and the receiver."""

from __future__ import annotations

import getpass
import json
import os
import socket
import struct
import sys
import threading
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager, suppress
from multiprocessing.connection import Client, Connection, Listener
from urllib.parse import quote

from platformdirs import user_runtime_path

if sys.platform != "win32":
    import fcntl

MAX_PATHS = 32
MAX_BYTES = 1 << 20
"""Largest message, in bytes: more than MAX_PATHS of the longest paths need."""
TAKEN = b"taken"
"""Answer of a window that opens the paths."""
ANSWER_S = 3.0
"""Time for the running window to answer, in seconds."""
READ_S = 1
"""Time for a sender to send its message, in seconds."""
CLOSE_S = 2.0
"""Time for the thread to end, in seconds."""
BACKLOG = 16
"""Number of senders that may wait."""


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


def hand_over(paths: Sequence[str]) -> bool:
    """Let the running window open these absolute paths; return whether it does.

    It opens one, so many need not be sent.
    """
    address = window_address()
    if address is None:
        return False
    try:
        with Client(address) as connection:
            connection.send_bytes(json.dumps(paths[:MAX_PATHS]).encode())
            return connection.poll(ANSWER_S) and connection.recv_bytes(len(TAKEN)) == TAKEN
    except (OSError, EOFError):
        return False


class Receiver:
    """Call it from the window's thread. One window receives; when it closes, another does. Only the latest paths are
    kept.
    """

    def __init__(self, wake: Callable[[], None]) -> None:
        """wake: called, in the thread, when paths were received."""
        self._wake = wake
        self._received: deque[tuple[str, ...]] = deque(maxlen=1)
        self._is_closed = self._is_listening = False
        self._address = ""
        self._thread = threading.Thread(target=self._serve, name="iibr-receiver", daemon=True)

    def listen(self) -> None:
        """Begin to listen, as soon as no other window does; never if there is no place for a socket."""
        self._address = window_address() or ""
        if self._address:
            self._thread.start()

    def has_another(self) -> bool:
        """Return whether another window receives paths."""
        with suppress(OSError):
            Client(window_address() or "").close()
            return True
        return False

    def take(self) -> tuple[str, ...] | None:
        """Return the paths that were received since the last call, () without paths; None if nothing was received."""
        return self._received.pop() if self._received else None

    def close(self) -> None:
        """Stop listening. A sender that holds the thread up is not waited for."""
        self._is_closed = True
        if self._is_listening:
            with suppress(OSError):
                Client(self._address).close()  # wakes the thread
            self._thread.join(CLOSE_S)

    def _serve(self) -> None:
        with suppress(OSError), _only_listener(self._address), Listener(self._address, backlog=BACKLOG) as listener:
            self._is_listening = True
            while not self._is_closed:
                with listener.accept() as connection:
                    self._receive(connection)

    def _receive(self, connection: Connection) -> None:
        paths = _paths_from_message(_read(connection))
        if paths is not None and not self._is_closed:
            self._received.append(paths)
            self._wake()
            with suppress(OSError):
                connection.send_bytes(TAKEN)


@contextmanager
def _only_listener(address: str) -> Iterator[None]:
    """Be the only window that listens at an address, once no other does; remove the socket that a killed one left.

    The system frees the lock when the process ends. On Windows the pipe is a lock of its own: it raises OSError while
    another process listens.
    """
    if sys.platform == "win32":
        yield
        return
    with open(f"{address}.lock", "ab") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        with suppress(FileNotFoundError):
            os.unlink(address)
        yield


def _read(connection: Connection) -> bytes:
    """Return the message of a sender, b"" if none comes in time or it is too long."""
    if sys.platform != "win32":  # the sender may stop in the middle
        with socket.socket(fileno=os.dup(connection.fileno())) as twin:
            twin.setsockopt(socket.SOL_SOCKET, socket.SO_RCVTIMEO, struct.pack("ll", READ_S, 0))
    try:
        return connection.recv_bytes(MAX_BYTES) if connection.poll(READ_S) else b""
    except (OSError, EOFError):
        return b""


def _paths_from_message(message: bytes) -> tuple[str, ...] | None:
    """Return the paths in a message, None if it is none: it may come from any program of the user."""
    try:
        paths = json.loads(message)
        are_paths = all(os.path.isabs(path) and b"\0" not in os.fsencode(path) for path in paths)
    except (ValueError, TypeError, RecursionError):
        return None
    return tuple(paths) if are_paths and isinstance(paths, list) and len(paths) <= MAX_PATHS else None
