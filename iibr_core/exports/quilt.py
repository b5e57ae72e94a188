"""Quilts for Looking Glass displays: drawn view by view, and shown by Bridge, the program of the display's maker.

Bridge runs beside the display and takes JSON by HTTP (endpoints and bodies as in its client bridge.js).
"""

import json
from http.client import HTTPException
from pathlib import Path
from typing import Any
from urllib.request import ProxyHandler, Request, build_opener

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import Optics
from iibr_core.exports.framing import draw_framed, side_pictures
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.files import reason_of
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
    return [each.optics for each in quilt_pictures(scene, optics, _quilt_of(scene, options.device), options.eyes)]


def write_quilt(path: Path, source: ExportSource, options: ExportOptions) -> str | None:
    """Write a quilt and show it if that is asked for; return a sentence about the display."""
    bridge = Bridge() if options.show else None  # a missing display is reported before anything is drawn
    quilt = _quilt_of(source.scene, options.device)
    source.write_picture(path, draw_quilt(source, quilt, options.eyes))
    return bridge.show_quilt(path, quilt) if bridge is not None else None


def quilt_pictures(scene: Scene, optics: Optics, quilt: Quilt, span_views: float | None = None) -> list[RenderSettings]:
    """Return the settings of the views of a quilt, the leftmost first.

    span_views: view steps from the first viewpoint to the last, None for those of the scene.
    """
    tile = RenderSettings(optics, ScreenSize(quilt.tile.width, quilt.tile.height))
    return side_pictures(scene, tile, quilt.views, scene.grid.columns - 1 if span_views is None else span_views)


def draw_quilt(source: ExportSource, quilt: Quilt, span_views: float | None = None) -> NDArray[np.uint8]:
    """Return the picture (H, W, 3) of a quilt. span_views: see `quilt_pictures`."""
    pictures = quilt_pictures(source.scene, source.optics, quilt, span_views)
    drawn = (draw_framed(source, picture, quilt.aspect) for picture in pictures)
    return lay_out(quilt, source.watched(drawn, quilt.views, "drawing views"))


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
        displays = _value(self._ask("available_output_devices"), "payload")
        names = displays if isinstance(displays, dict) else {}
        kinds = [_value(_value(displays, name), "hardwareVersion") for name in names]
        if all(kind in (None, MONITOR) for kind in kinds):
            raise InputError("Looking Glass Bridge sees no display; connect one, and switch it on")

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
