"""A hub on this machine that answers as the Hugging Face hub does when files of one commit are downloaded."""

import hashlib
import threading
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer

LARGE = (".safetensors", ".onnx")
"""Endings of files that the hub sends from another host, with their SHA-256 as their tag."""


class Hub(ThreadingHTTPServer):
    """The server. files: what it sends, by name; stated: what it states sizes and hashes of.

    asked: paths of all requests. begins: first byte of each request for a large file. may_finish: until it is set, only
    half of a large file is sent. is_cut: large files end there.
    """

    daemon_threads = True

    def __init__(self, commit: str, files: Mapping[str, bytes]) -> None:
        super().__init__(("127.0.0.1", 0), _Answer)
        self.commit, self.files, self.stated = commit, dict(files), dict(files)
        self.may_finish = threading.Event()
        self.may_finish.set()
        self.is_cut = False
        self.asked: list[str] = []
        self.begins: list[int] = []

    @property
    def address(self) -> str:
        return f"http://127.0.0.1:{self.server_address[1]}"


class _Answer(BaseHTTPRequestHandler):
    server: Hub

    def do_HEAD(self) -> None:
        self._answer(is_head=True)

    def do_GET(self) -> None:
        self._answer(is_head=False)

    def _answer(self, is_head: bool) -> None:
        hub, path = self.server, self.path.partition("?")[0]
        hub.asked.append(path)
        commit, _, name = path.rpartition("/resolve/")[2].partition("/")
        if path.startswith("/large/"):
            self._send_large(path.removeprefix("/large/"))
        elif commit != hub.commit or name not in hub.stated:
            self._send(404, b"", {"X-Error-Code": "EntryNotFound"}, is_head)
        elif path.endswith(LARGE):
            size, tag = len(hub.stated[name]), hashlib.sha256(hub.stated[name]).hexdigest()
            stated = {"X-Repo-Commit": commit, "X-Linked-Size": str(size), "X-Linked-ETag": f'"{tag}"'}
            self._send(302, b"", {**stated, "Location": f"http://localhost:{hub.server_port}/large/{name}"}, is_head)
        else:
            self._send(200, hub.files[name], {"X-Repo-Commit": commit, "ETag": '"blob"'}, is_head)

    def _send(self, status: int, body: bytes, headers: Mapping[str, str], is_head: bool) -> None:
        self.send_response(status)
        for header in {**headers, "Content-Length": str(len(body))}.items():
            self.send_header(*header)
        self.end_headers()
        if not is_head:
            self.wfile.write(body)

    def _send_large(self, name: str) -> None:
        hub, body = self.server, self.server.files[name]
        begin = int(self.headers.get("Range", "bytes=0-").removeprefix("bytes=").rstrip("-"))
        hub.begins.append(begin)
        self.send_response(206 if begin else 200)
        self.send_header("Content-Length", str(len(body) - begin))
        self.send_header("Content-Range", f"bytes {begin}-{len(body) - 1}/{len(body)}")
        self.end_headers()
        half = max(len(body) // 2, begin)
        with suppress(OSError):  # nobody waits for it any more
            self.wfile.write(body[begin:half])
            if not hub.is_cut and hub.may_finish.wait(60):
                self.wfile.write(body[half:])
        hub.is_cut = False

    def log_message(self, *_: object) -> None:
        pass


@contextmanager
def local_hub(commit: str, files: Mapping[str, bytes]) -> Iterator[Hub]:
    with Hub(commit, files) as hub:
        threading.Thread(target=hub.serve_forever).start()
        yield hub
        hub.may_finish.set()
        hub.shutdown()
