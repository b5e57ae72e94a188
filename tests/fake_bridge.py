"""A Looking Glass Bridge that answers on this machine."""

import json
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

import pytest

from iibr_core.exports import quilt

TOKEN = "some session"
PORTRAIT, MONITOR = {"hardwareVersion": {"value": "portrait"}}, {"hardwareVersion": {"value": "thirdparty"}}


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


@contextmanager
def fake_bridge(monkeypatch: pytest.MonkeyPatch) -> Iterator[FakeBridge]:
    """Run a Bridge, and use it in place of the usual one."""
    monkeypatch.setenv("http_proxy", "http://localhost:1")  # must not be used for this machine
    with FakeBridge() as server:
        thread = threading.Thread(target=server.serve_forever, args=(0.02,))
        thread.start()
        monkeypatch.setattr(quilt, "ADDRESS", f"localhost:{server.server_port}")
        yield server
        server.shutdown()
        thread.join()
