import json
import threading
from collections.abc import Iterator
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from iibr_core.exports import quilt
from iibr_core.exports.kinds import EXPORTS, ExportOptions
from iibr_core.exports.source import write_export
from iibr_core.types import InputError
from tests.iibr_core.exports.conftest import exported

TOKEN = "some session"
PORTRAIT, MONITOR = {"hardwareVersion": {"value": "portrait"}}, {"hardwareVersion": {"value": "thirdparty"}}
SHOWING = ["show_window", "delete_playlist", "instance_playlist", "insert_playlist_entry", "play_playlist"]


class FakeBridge(ThreadingHTTPServer):
    """A Bridge with connected displays. failing: endpoints that fail; raw: answers in bytes by endpoint."""

    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("localhost", 0), Handler)
        self.displays: list[dict[str, Any]] = [MONITOR, PORTRAIT]
        self.raw: dict[str, bytes] = {}
        self.failing: set[str] = {"delete_playlist"}  # there is none at first
        self.requests: list[tuple[str, dict[str, Any]]] = []


class Handler(BaseHTTPRequestHandler):
    server: FakeBridge

    def do_PUT(self) -> None:
        assert self.headers["Content-Type"] == "application/json"
        endpoint = self.path.removeprefix("/")
        body = json.loads(self.rfile.read(int(self.headers["Content-Length"])))
        self.server.requests.append((endpoint, body))
        payload: Any = {"value": TOKEN}
        if endpoint == "available_output_devices":
            payload = {"value": {str(i): {"value": display} for i, display in enumerate(self.server.displays)}}
        status = "Failure" if endpoint in self.server.failing else "Completion"
        answer = json.dumps({"name": endpoint, "payload": payload, "status": {"value": status}}).encode()
        self.send_response(200)
        self.end_headers()
        self.wfile.write(self.server.raw.get(endpoint, answer))

    def log_message(self, *_: Any) -> None:
        """Print nothing."""


@pytest.fixture
def bridge(monkeypatch) -> Iterator[FakeBridge]:
    monkeypatch.setenv("http_proxy", "http://localhost:1")  # must not be used for this machine
    with FakeBridge() as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        monkeypatch.setattr(quilt, "ADDRESS", f"localhost:{server.server_port}")
        yield server
        server.shutdown()
        thread.join()


def test_a_quilt_is_shown(bridge, source, tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    options = ExportOptions(show=True)
    assert write_export(EXPORTS["quilt"], Path("a_qs8x6a1.5.png"), source, options) == "It is shown on the display."
    (out,) = tmp_path.glob("a_qs8x6a*.png")
    asked = [endpoint for endpoint, _ in bridge.requests]
    assert asked == ["enter_orchestration", "available_output_devices", *SHOWING]
    assert all(body["orchestration"] == TOKEN for _, body in bridge.requests[1:])
    entry = dict(bridge.requests)["insert_playlist_entry"]
    assert entry["uri"] == str(out), "an absolute path: Bridge has another working folder"
    assert (entry["cols"], entry["rows"], entry["view_count"], entry["aspect"]) == (8, 6, 48, 1.5)
    assert dict(bridge.requests)["play_playlist"]["head_index"] == -1


TROUBLE = {
    "nothing": ({"server_port": 1}, "Looking Glass Bridge does not answer"),
    "no display": ({"displays": [MONITOR]}, "sees no display"),
    "old": ({"raw": {"enter_orchestration": b""}}, "enter_orchestration .no answer"),
    "failing": ({"failing": {"play_playlist"}}, "play_playlist .Failure"),
}


@pytest.mark.parametrize("trouble", TROUBLE)
def test_failures_are_one_line(bridge, source, tmp_path, trouble, monkeypatch) -> None:
    changes, message = TROUBLE[trouble]
    for name, value in changes.items():
        setattr(bridge, name, value)
    monkeypatch.setattr(quilt, "ADDRESS", f"localhost:{bridge.server_port}")
    with pytest.raises(InputError, match=message) as error:
        exported(source, "quilt", tmp_path / "a.png", show=True)
    assert "\n" not in str(error.value)
    assert bool(list(tmp_path.iterdir())) == (trouble == "failing"), "Bridge answers before anything is drawn"
