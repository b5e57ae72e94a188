"""Pictures shown on a Looking Glass display by Bridge, its maker's program that runs beside it and takes JSON by HTTP
(endpoints and bodies as its published client has them, bridge.js). What it does not know it answers with nothing.
Whatever else listens there may answer anything: how long and how large an answer may be is bounded.
"""

from __future__ import annotations

import json
import socket
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from http.client import OK, HTTPConnection, HTTPException
from pathlib import Path
from threading import Event, Timer
from typing import Any

from iibr_core.formats.files import reason_of
from iibr_core.formats.quilts import Quilt
from iibr_core.types import InputError

ADDRESS = "localhost:33334"
ANSWER_S = 10.0
"""For a whole answer."""
MOST_ANSWER_BYTES = 1 << 20
PLAYLIST = "iibr"
FIRST_DISPLAY = -1
FAILURES = ("Failure", "UnknownOrchestration")
MONITOR = "thirdparty"
"""What Bridge calls screens that are no Looking Glass."""


class Bridge:
    """A session with the Bridge that runs here. What it is told comes back in one line where it fails."""

    def __init__(self) -> None:
        """Raises InputError where none answers, or it has no display."""
        self._session = ""
        session = _value(self._ask("enter_orchestration", name="default"), "payload")
        if not isinstance(session, str) or not session:
            raise InputError(f"the program at {ADDRESS} is not Looking Glass Bridge (it names no session); update it")
        self._session = session
        displays = _value(self._ask("available_output_devices"), "payload")
        names = displays if isinstance(displays, dict) else {}
        kinds = [_value(_value(displays, name), "hardwareVersion") for name in names]
        if all(kind in (None, MONITOR) for kind in kinds):
            raise InputError("Looking Glass Bridge sees no display; connect one, and switch it on")

    def show_quilt(self, path: Path, quilt: Quilt) -> str:
        """Show a quilt that was written, on the first display; returns a sentence for people. Raises InputError."""
        try:
            self._play(path, quilt)
        except InputError as error:
            raise InputError(f"{path}: is written, but {error}") from error
        return "It is shown on the display."

    def _play(self, path: Path, quilt: Quilt) -> None:
        """By a playlist of one entry, in place of the one before."""
        entry: dict[str, Any] = {"id": 0, "index": 0, "name": PLAYLIST, "uri": str(path.absolute()), "isRGBD": 0}
        entry |= {"rows": quilt.rows, "cols": quilt.columns, "view_count": quilt.views, "aspect": quilt.aspect}
        entry |= {"focus": 0, "zoom": 1, "crop_pos_x": 0, "crop_pos_y": 0, "tag": ""}
        self._ask("show_window", show_window=True, head_index=FIRST_DISPLAY)
        self._ask("delete_playlist", may_fail=True, name=PLAYLIST, loop=True)
        self._ask("instance_playlist", name=PLAYLIST, loop=True)
        self._ask("insert_playlist_entry", **entry)
        self._ask("play_playlist", name=PLAYLIST, head_index=FIRST_DISPLAY)

    def _ask(self, endpoint: str, may_fail: bool = False, **body: Any) -> dict[str, Any]:
        """Its answer. Raises InputError where there is none, or it says that it failed, unless it may."""
        content = json.dumps({"orchestration": self._session, **body} if self._session else body).encode()
        try:
            answer = _answer_to(endpoint, content)
        except (OSError, HTTPException, ValueError, RecursionError) as error:
            raise InputError(
                f"Looking Glass Bridge does not answer at {ADDRESS} ({reason_of(error)}); start it, or do not show"
                " it there"
            ) from error
        status = _value(answer, "status")
        if not may_fail and (not isinstance(status, str) or status in FAILURES):
            said = reason_of(str(status)) if status else "no answer"
            raise InputError(f"Looking Glass Bridge refused {endpoint} ({said}); update it")
        return answer if isinstance(answer, dict) else {}


def _answer_to(endpoint: str, content: bytes) -> Any:
    """The JSON of an answer, {} for an empty one. Raises OSError, HTTPException, ValueError, RecursionError."""
    connection = HTTPConnection(ADDRESS, timeout=ANSWER_S)  # asks no proxy
    try:
        connection.connect()
        with _shut_after(connection.sock, ANSWER_S):
            connection.request("PUT", f"/{endpoint}", content, {"Content-Type": "application/json"})
            response = connection.getresponse()
            stored = response.read(MOST_ANSWER_BYTES + 1)
    finally:
        connection.close()
    if response.status != OK:
        raise ValueError(f"HTTP status {response.status}")
    if len(stored) > MOST_ANSWER_BYTES:
        raise ValueError(f"more than {MOST_ANSWER_BYTES:,} bytes")
    if response.length:
        raise ValueError(f"cut off, {response.length:,} bytes are missing")
    return json.loads(stored) if stored.strip() else {}


@contextmanager
def _shut_after(connected: socket.socket, seconds: float) -> Iterator[None]:
    """Raise TimeoutError where the block takes longer: its socket's own limit begins again with every byte."""
    is_late = Event()

    def shut() -> None:
        is_late.set()
        with suppress(OSError):
            connected.shutdown(socket.SHUT_RDWR)

    timer = Timer(seconds, shut)
    timer.daemon = True
    timer.start()
    try:
        yield
    except (OSError, HTTPException):
        if not is_late.is_set():
            raise
    finally:
        timer.cancel()
    if is_late.is_set():
        raise TimeoutError(f"no whole answer within {seconds:g} s")


def _value(answer: Any, name: str) -> Any:
    """Of a member, as Bridge wraps them: {"payload": {"name": ..., "type": ..., "value": ...}}; None without."""
    member = answer.get(name) if isinstance(answer, dict) else None
    return member.get("value") if isinstance(member, dict) else None
