"""As much of the Hugging Face hub as a download asks for, on this machine: one commit of one repository, and what can
go wrong with it.
"""

from __future__ import annotations

import hashlib
import json
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from typing import Any

LARGE = (".safetensors", ".onnx")
"""Files of these endings are kept apart from git there, and known by their SHA-256."""


class Hub(ThreadingHTTPServer):
    """files: by name, as they are sent; stated: as the hub says they are, the same unless changed. Large files are sent
    after a redirect, from the byte on that is asked for. asked: paths of all requests; begins: for each large file that
    was asked for, the byte.

    What can go wrong: may_finish: until then half of large files is sent; lost_patience: it took a minute. refusal: the
    status that answers all, with headers. says: what is answered instead of JSON. cuts: large files end in the middle.
    knows_ranges: else they are sent from their beginning.
    """

    daemon_threads = True

    def __init__(self, commit: str, files: Mapping[str, bytes]) -> None:
        super().__init__(("127.0.0.1", 0), _Answer)
        self.commit, self.files, self.stated = commit, dict(files), dict(files)
        self.may_finish = threading.Event()
        self.may_finish.set()
        self.refusal: tuple[int, dict[str, str]] | None = None
        self.says: bytes | None = None
        self.cuts, self.knows_ranges, self.lost_patience = False, True, False
        self.asked: list[str] = []
        self.begins: list[int] = []

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}"

    def description(self) -> bytes:
        siblings = [{"rfilename": name, **_about(name, data)} for name, data in self.stated.items()]
        return json.dumps({"id": "a/b", "sha": self.commit, "siblings": siblings}).encode()


class _Answer(BaseHTTPRequestHandler):
    server: Hub

    def do_GET(self) -> None:
        hub, path = self.server, self.path.partition("?")[0]
        hub.asked.append(path)
        name = path.rpartition("/resolve/")[2].partition("/")[2]
        if hub.refusal is not None:
            self._send(hub.refusal[0], b"", hub.refusal[1])
        elif path.startswith("/api/"):
            self._send(200, hub.description() if hub.says is None else hub.says, {})
        elif path.startswith("/large/"):
            self._send_large(path.removeprefix("/large/"))
        elif path.endswith(LARGE):
            size, tag = len(hub.stated[name]), _digest(name, hub.stated[name])
            about = {"X-Repo-Commit": hub.commit, "X-Linked-Size": str(size), "X-Linked-ETag": f'"{tag}"'}
            self._send(302, b"", {**about, "Location": f"{hub.address}/large/{name}"})
        else:
            self._send(200, hub.files[name], {"ETag": f'"{_digest(name, hub.stated[name])}"'})

    def _send(self, status: int, body: bytes, headers: Mapping[str, str]) -> None:
        self.send_response(status)
        for header in {**headers, "Content-Length": str(len(body))}.items():
            self.send_header(*header)
        self.end_headers()
        self.wfile.write(body)

    def _send_large(self, name: str) -> None:
        hub, body = self.server, self.server.files[name]
        begin = int(self.headers.get("Range", "bytes=0-").removeprefix("bytes=").rstrip("-"))
        hub.begins.append(begin)
        begin = begin if hub.knows_ranges else 0
        self.send_response(206 if begin else 200)
        self.send_header("Content-Length", str(len(body) - begin))
        if begin:
            self.send_header("Content-Range", f"bytes {begin}-{len(body) - 1}/{len(body)}")
        self.end_headers()
        half = max(len(body) // 2, begin)
        self.wfile.write(body[begin:half])
        if not hub.cuts:
            hub.lost_patience = not hub.may_finish.wait(60)
            with suppress(OSError):  # nobody waits for it any more
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
