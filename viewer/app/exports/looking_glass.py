"""Pictures shown on a Looking Glass display by Bridge, its maker's program that runs beside it and takes JSON by HTTP
(endpoints and bodies as its published client has them, bridge.js). What it does not know it answers with nothing.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any
from urllib.error import URLError
from urllib.request import ProxyHandler, Request, build_opener

from iibr_core.formats.files import reason_of
from iibr_core.formats.quilts import Quilt
from iibr_core.types import InputError

ADDRESS = "http://localhost:33334"
ANSWER_S = 10.0
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
        self._session = str(_value(self._ask("enter_orchestration", name="default"), "payload"))
        displays: dict[str, Any] = _value(self._ask("available_output_devices"), "payload") or {}
        kinds = [_value(_value(displays, name), "hardwareVersion") for name in displays]
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
        request = Request(f"{ADDRESS}/{endpoint}", content, {"Content-Type": "application/json"}, method="PUT")
        try:
            with build_opener(ProxyHandler({})).open(request, timeout=ANSWER_S) as response:
                stored = response.read()
            answer = json.loads(stored) if stored.strip() else {}
        except (URLError, OSError, ValueError) as error:
            raise InputError(
                f"no Looking Glass Bridge answers at {ADDRESS} ({reason_of(error)}); start it, or do not show it there"
            ) from error
        status = _value(answer, "status")
        if not may_fail and (status is None or status in FAILURES):
            raise InputError(f"Looking Glass Bridge did not do {endpoint} ({status or 'no answer'}); update it")
        return dict(answer)


def _value(answer: Any, name: str) -> Any:
    """Of a member, as Bridge wraps them: {"payload": {"name": ..., "type": ..., "value": ...}}; None without."""
    member = answer.get(name) if isinstance(answer, dict) else None
    return member.get("value") if isinstance(member, dict) else None
