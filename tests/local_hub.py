"""As much of the Hugging Face hub as a download asks for, on this machine: one commit of one repository."""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

LARGE = (".safetensors", ".onnx")
"""Files of these endings are kept apart from git there, and known by their SHA-256."""


class Hub(ThreadingHTTPServer):
    """files: by name, as they are sent; stated: as the hub says they are, the same unless changed. may_finish: until
    then half of large files is sent. asked: paths of all requests.
    """

    daemon_threads = True

    def __init__(self, commit: str, files: Mapping[str, bytes]) -> None:
        super().__init__(("127.0.0.1", 0), _Answer)
        self.commit, self.files, self.stated = commit, dict(files), dict(files)
        self.may_finish = threading.Event()
        self.may_finish.set()
        self.asked: list[str] = []

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}"

    def answer(self, path: str) -> tuple[bytes, str]:
        """What is sent for a path, and its tag."""
        name = path.rpartition("/resolve/")[2].partition("/")[2]
        if not path.startswith("/api/"):
            return self.files[name], _digest(name, self.stated[name])
        if "/tree/" in path:
            entries = [{"type": "file", "path": name, **_about(name, data)} for name, data in self.stated.items()]
            return json.dumps([{**entry, "oid": entry["blobId"]} for entry in entries]).encode(), "tree"
        siblings = [{"rfilename": name, **_about(name, data)} for name, data in self.stated.items()]
        return json.dumps({"id": "a/b", "sha": self.commit, "siblings": siblings}).encode(), "about"


class _Answer(BaseHTTPRequestHandler):
    def do_HEAD(self) -> None:
        self.do_GET()

    def do_GET(self) -> None:
        hub: Any = self.server
        path = self.path.partition("?")[0]
        hub.asked.append(path)
        body, tag = hub.answer(path)
        self.send_response(200)
        for header in (("ETag", f'"{tag}"'), ("X-Repo-Commit", hub.commit), ("Content-Length", str(len(body)))):
            self.send_header(*header)
        self.end_headers()
        if self.command == "GET":
            half = len(body) // 2 if path.endswith(LARGE) else len(body)
            self.wfile.write(body[:half])
            hub.may_finish.wait(60)
            self.wfile.write(body[half:])

    def log_message(self, *_: object) -> None:
        pass


def _digest(name: str, data: bytes) -> str:
    if name.endswith(LARGE):
        return hashlib.sha256(data).hexdigest()
    return hashlib.sha1(b"blob %d\0" % len(data) + data).hexdigest()


def _about(name: str, data: bytes) -> dict[str, Any]:
    about = {"size": len(data), "blobId": hashlib.sha1(b"blob %d\0" % len(data) + data).hexdigest()}
    if not name.endswith(LARGE):
        return about
    sha256 = _digest(name, data)
    return {**about, "lfs": {"size": len(data), "sha256": sha256, "oid": sha256, "pointerSize": 130}}


@contextmanager
def local_hub(commit: str, files: Mapping[str, bytes]) -> Iterator[Hub]:
    """Run one until the block ends."""
    with Hub(commit, files) as hub:
        threading.Thread(target=hub.serve_forever).start()
        yield hub
        hub.may_finish.set()
        hub.shutdown()
