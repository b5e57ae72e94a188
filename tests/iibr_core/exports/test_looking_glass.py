"""Quilts shown by Looking Glass Bridge: against an HTTP server that answers as Bridge does."""

from __future__ import annotations

import json
import socketserver
import threading
from collections.abc import Iterator
from contextlib import suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from typing import Any

import pytest

from iibr_core.exports import looking_glass
from iibr_core.exports.kinds import EXPORTS
from iibr_core.exports.options import ExportOptions
from iibr_core.exports.source import ExportSource
from iibr_core.exports.writers import writer_of
from iibr_core.types import InputError
from tests.iibr_core.exports.conftest import exported

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
        monkeypatch.setattr(looking_glass, "ADDRESS", f"localhost:{server.server_port}")
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
        ("nobody", "Looking Glass Bridge does not answer"),
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
            monkeypatch.setattr(looking_glass, "ADDRESS", "localhost:1")
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


def _answer(body: bytes, status: bytes = b"200 OK") -> bytes:
    return b"HTTP/1.1 " + status + b"\r\nContent-Length: %d\r\n\r\n" % len(body) + body


def _said(payload: Any, status: Any = "Completion") -> bytes:
    return _answer(json.dumps({"payload": {"value": payload}, "status": {"value": status}}).encode())


DRIPS = b"drips"


class RawServer(socketserver.ThreadingTCPServer):
    """Answers every connection with the next of these bytes, the last one again and again."""

    daemon_threads = allow_reuse_address = True
    block_on_close = False

    def __init__(self, answers: list[bytes]) -> None:
        super().__init__(("localhost", 0), RawHandler)
        self.answers, self.count = answers, 0
        self.is_over = threading.Event()


class RawHandler(socketserver.BaseRequestHandler):
    server: RawServer

    def handle(self) -> None:
        answer = self.server.answers[min(self.server.count, len(self.server.answers) - 1)]
        self.server.count += 1
        with suppress(OSError):
            asked = b""
            while not asked.endswith(b"}"):  # what is left unread resets the connection
                asked += self.request.recv(1 << 16)
            if answer.startswith(DRIPS):
                self.request.sendall(answer.removeprefix(DRIPS))
                while not self.server.is_over.wait(0.01):
                    self.request.sendall(b"x")
            else:
                self.request.sendall(answer)


@pytest.mark.parametrize(
    ("answers", "says"),
    [
        pytest.param([b""], "Looking Glass Bridge does not answer", id="closed at once"),
        pytest.param([b"\x00\xff garbage\r\n\r\n"], "Looking Glass Bridge does not answer", id="no HTTP"),
        pytest.param([_answer(b"oh no", b"500 Oh no")], "HTTP status 500", id="500"),
        pytest.param([_answer(b"<html>")], "Looking Glass Bridge does not answer", id="no JSON"),
        pytest.param([_answer(b" " * (2 << 20))], "more than 1,048,576 bytes", id="huge"),
        pytest.param([_answer(b"[" * 100_000)], "Looking Glass Bridge does not answer", id="deep"),
        pytest.param([_answer(b"\xff\xfe\xfd")], "Looking Glass Bridge does not answer", id="no text"),
        pytest.param([b"HTTP/1.1 200 OK\r\nContent-Length: 99\r\n\r\n{}"], "97 bytes are missing", id="cut off"),
        pytest.param([DRIPS], "no whole answer within", id="drips"),
        pytest.param([DRIPS + b"HTTP/1.1 200 OK\r\nA: "], "no whole answer within", id="drips a header"),
        pytest.param([DRIPS + b"HTTP/1.1 200 OK\r\n\r\n"], "no whole answer within", id="drips a body"),
        *(
            pytest.param([_answer(body)], "refused enter_orchestration", id=f"answers {body.decode()}")
            for body in (b"null", b"[1]", b"7", b'"x"', b'{"status": []}', b'{"status": {"value": [1]}}')
        ),
        *(
            pytest.param([_said(session)], "names no session", id=f"session {session}")
            for session in (None, 7, [], {"a": 1}, "")
        ),
        *(
            pytest.param([_said("a"), _said(displays)], "sees no display", id=f"displays {displays}")
            for displays in (None, 7, "x", [1, [2]], {"0": 7}, {"0": {"value": None}})
        ),
    ],
)
def test_whatever_answers_there_ends_in_one_line(
    answers: list[bytes], says: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(looking_glass, "ANSWER_S", 0.3 if answers[0].startswith(DRIPS) else 10.0)
    with RawServer(answers) as server:
        thread = threading.Thread(target=server.serve_forever, daemon=True)
        thread.start()
        monkeypatch.setattr(looking_glass, "ADDRESS", f"localhost:{server.server_address[1]}")
        try:
            with pytest.raises(InputError, match=says) as error:
                looking_glass.Bridge()
        finally:
            server.is_over.set()
            server.shutdown()
            thread.join()
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 400
