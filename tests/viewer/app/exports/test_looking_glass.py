"""Quilts shown by Looking Glass Bridge: against an HTTP server that answers as Bridge does."""

from __future__ import annotations

import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from iibr_core.types import InputError
from tests.viewer.app.exports.conftest import exported
from viewer.app.exports import looking_glass
from viewer.app.exports.registry import writer_of
from viewer.app.exports.source import ExportSource
from viewer.model.export_kinds import EXPORTS
from viewer.model.state.exporting import ExportOptions

TOKEN = "some session"
PORTRAIT, MONITOR = {"hardwareVersion": {"value": "portrait"}}, {"hardwareVersion": {"value": "thirdparty"}}
SHOWING = ["show_window", "delete_playlist", "instance_playlist", "insert_playlist_entry", "play_playlist"]


class FakeBridge(ThreadingHTTPServer):
    """displays: that are connected. unknown: endpoints answered with nothing, failing: with a failure."""

    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("localhost", 0), Handler)
        self.displays: list[dict[str, Any]] = [MONITOR, PORTRAIT]
        self.unknown: set[str] = set()
        self.failing: set[str] = {"delete_playlist"}  # there is none at first
        self.asked: list[tuple[str, dict[str, Any]]] = []


class Handler(BaseHTTPRequestHandler):
    server: FakeBridge

    def do_PUT(self) -> None:
        assert self.headers["Content-Type"] == "application/json"
        endpoint = self.path.removeprefix("/")
        body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.server.asked.append((endpoint, body))
        payload: Any = {"value": TOKEN}
        if endpoint == "available_output_devices":
            payload = {"value": {str(i): {"value": display} for i, display in enumerate(self.server.displays)}}
        status = "Failure" if endpoint in self.server.failing else "Completion"
        answer = json.dumps({"name": endpoint, "payload": payload, "status": {"value": status}}).encode()
        self.send_response(200)
        self.end_headers()
        self.wfile.write(b"" if endpoint in self.server.unknown else answer)

    def log_message(self, *_: Any) -> None:
        """Say nothing."""


@pytest.fixture
def bridge(monkeypatch: pytest.MonkeyPatch) -> Iterator[FakeBridge]:
    monkeypatch.setenv("http_proxy", "http://localhost:1")  # what runs here is not asked through others
    with FakeBridge() as server:
        thread = threading.Thread(target=server.serve_forever)
        thread.start()
        monkeypatch.setattr(looking_glass, "ADDRESS", f"http://localhost:{server.server_port}")
        yield server
        server.shutdown()
        thread.join()


def test_a_quilt_is_shown(
    bridge: FakeBridge, source: ExportSource, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    options = ExportOptions(show=True)
    assert writer_of(EXPORTS["quilt"])(Path("a_qs8x6a1.5.png"), source, options) == "It is shown on the display."
    (out,) = tmp_path.glob("a_qs8x6a*.png")
    assert [endpoint for endpoint, _ in bridge.asked] == ["enter_orchestration", "available_output_devices", *SHOWING]
    assert all(body["orchestration"] == TOKEN for _, body in bridge.asked[1:])
    entry = dict(bridge.asked)["insert_playlist_entry"]
    assert entry["uri"] == str(out), "its whole path: Bridge works elsewhere"
    assert (entry["cols"], entry["rows"], entry["view_count"], entry["aspect"]) == (8, 6, 48, 1.5)
    assert dict(bridge.asked)["play_playlist"]["head_index"] == -1


@pytest.mark.parametrize(
    ("trouble", "says"),
    [
        ("nobody", "no Looking Glass Bridge answers"),
        ("no display", "sees no display"),
        ("old", "enter_orchestration .no answer"),
        ("failing", "play_playlist .Failure"),
    ],
)
def test_what_goes_wrong_is_one_line(
    bridge: FakeBridge, source: ExportSource, tmp_path: Path, trouble: str, says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    match trouble:
        case "nobody":
            monkeypatch.setattr(looking_glass, "ADDRESS", "http://localhost:1")
        case "no display":
            bridge.displays = [MONITOR]
        case "old":
            bridge.unknown = {"enter_orchestration"}
        case "failing":
            bridge.failing = {"play_playlist"}
    with pytest.raises(InputError, match=says) as error:
        exported(source, "quilt", tmp_path / "a.png", show=True)
    assert "\n" not in str(error.value)
    assert bool(list(tmp_path.iterdir())) == (trouble == "failing"), "asked before anything is drawn"
