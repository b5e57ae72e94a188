"""Quilts for Looking Glass displays: drawn view by view, and shown by Bridge, the program of the display's maker.

Bridge runs beside the display and takes JSON by HTTP (endpoints and bodies as in its client bridge.js).
"""

import json
from http.client import HTTPException
from pathlib import Path
from typing import Any
from urllib.request import ProxyHandler, Request, build_opener

from iibr_core.beyond.optics import Optics
from iibr_core.exports.framing import draw_framed, side_pictures
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.files import reason_of
from iibr_core.formats.lenticular import Calibration, parse_calibration
from iibr_core.formats.quilts import Quilt, lay_out, quilt_for, tagged
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ImageSize, InputError

ADDRESS = "localhost:33334"
TIMEOUT_S, MAX_ANSWER_BYTES = 10.0, 1 << 20
PLAYLIST, FIRST_DISPLAY = "iibr", -1
FAILURES = ("Failure", "UnknownOrchestration")
MONITOR = "thirdparty"
"""Hardware version of screens that are no Looking Glass."""


def quilt_path(path: Path, scene: Scene, options: ExportOptions) -> Path:
    """Return the path with the tag that players read."""
    return tagged(path, _quilt_of(scene, options.device).tag)


def optics_of_quilt(scene: Scene, optics: Optics, options: ExportOptions) -> list[Optics]:
    """Return the optics of its views, the leftmost first."""
    tile, count = RenderSettings(optics, options.size), _quilt_of(scene, options.device).views
    return [picture.optics for picture in side_pictures(scene, tile, count, options.eyes)]


def write_quilt(path: Path, source: ExportSource, options: ExportOptions) -> str | None:
    """Write a quilt and show it if that is asked for; return a sentence about the display."""
    bridge = Bridge() if options.show else None  # a missing display is reported before anything is drawn
    quilt = _quilt_of(source.scene, options.device)
    tile = RenderSettings(source.optics, ScreenSize(quilt.tile.width, quilt.tile.height))
    pictures = side_pictures(source.scene, tile, quilt.views, options.eyes)
    drawn = (draw_framed(source, picture, quilt.aspect) for picture in pictures)
    source.write_picture(path, lay_out(quilt, source.watched(drawn, quilt.views, "drawing views")))
    return bridge.show_quilt(path, quilt) if bridge is not None else None


def _quilt_of(scene: Scene, device: str | None) -> Quilt:
    return quilt_for(device, ImageSize(scene.height, scene.width))


class Bridge:
    """A session with the Looking Glass Bridge on this machine."""

    def __init__(self) -> None:
        """Open a session."""
        self._session = ""
        session = _value(self._ask("enter_orchestration", name="default"), "payload")
        if not isinstance(session, str) or not session:
            raise InputError(f"the program at {ADDRESS} is not Looking Glass Bridge (it names no session); update it")
        self._session = session
        listed = _value(self._ask("available_output_devices"), "payload")
        displays = [_value(listed, name) for name in listed] if isinstance(listed, dict) else []
        self._displays = [each for each in displays if _value(each, "hardwareVersion") not in (None, MONITOR)]
        if not self._displays:
            raise InputError("Looking Glass Bridge sees no display; connect one, and switch it on")

    def first_display(self) -> tuple[Calibration, tuple[int, int] | None]:
        """Return the calibration of the first display, and the place (x, y) of its monitor on the desktop, if known."""
        text, place = (_value(self._displays[0], name) for name in ("calibration", "windowCoords"))
        x, y = (place.get(axis) if isinstance(place, dict) else None for axis in "xy")
        display = parse_calibration(text if isinstance(text, str) else "", "the display that Bridge reports")
        return display, (x, y) if isinstance(x, int) and isinstance(y, int) else None

    def show_quilt(self, path: Path, quilt: Quilt) -> str:
        """Show a written quilt on the first display; return a sentence for the user."""
        entry: dict[str, Any] = {"id": 0, "index": 0, "name": PLAYLIST, "uri": str(path.absolute()), "isRGBD": 0}
        entry |= {"rows": quilt.rows, "cols": quilt.columns, "view_count": quilt.views, "aspect": quilt.aspect}
        entry |= {"focus": 0, "zoom": 1, "crop_pos_x": 0, "crop_pos_y": 0, "tag": ""}
        try:
            self._ask("show_window", show_window=True, head_index=FIRST_DISPLAY)
            self._ask("delete_playlist", may_fail=True, name=PLAYLIST, loop=True)
            self._ask("instance_playlist", name=PLAYLIST, loop=True)
            self._ask("insert_playlist_entry", **entry)
            self._ask("play_playlist", name=PLAYLIST, head_index=FIRST_DISPLAY)
        except InputError as error:
            raise InputError(f"{path}: is written, but {error}") from error
        return "It is shown on the display."

    def _ask(self, endpoint: str, may_fail: bool = False, **body: Any) -> Any:
        content = json.dumps({"orchestration": self._session, **body} if self._session else body).encode()
        request = Request(f"http://{ADDRESS}/{endpoint}", content, {"Content-Type": "application/json"}, method="PUT")
        try:
            with build_opener(ProxyHandler({})).open(request, timeout=TIMEOUT_S) as response:
                answer = json.loads(response.read(MAX_ANSWER_BYTES).strip() or b"{}")
        except (OSError, HTTPException, ValueError, RecursionError) as error:
            raise InputError(
                f"Looking Glass Bridge does not answer at {ADDRESS} ({reason_of(error)}); start it, or do not show"
                " it there"
            ) from error
        status = _value(answer, "status")
        if not may_fail and (not isinstance(status, str) or status in FAILURES):
            reason = reason_of(str(status)) if status else "no answer"
            raise InputError(f"Looking Glass Bridge refused {endpoint} ({reason}); update it")
        return answer


def _value(answer: Any, name: str) -> Any:
    """Return the value of a member, which Bridge wraps as {"name": ..., "type": ..., "value": ...}, or None."""
    member = answer.get(name) if isinstance(answer, dict) else None
    return member.get("value") if isinstance(member, dict) else None
