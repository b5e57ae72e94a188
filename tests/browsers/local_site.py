"""A web site on this machine under any name: browsers reach it as their proxy, and nothing beyond it."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from urllib.parse import urlsplit


class LocalSite(ThreadingHTTPServer):
    """The server. pages: its files of HTML by path; any other request is refused."""

    daemon_threads = True

    def __init__(self) -> None:
        super().__init__(("127.0.0.1", 0), _Answer)
        self.pages: dict[str, bytes] = {}


class _Answer(BaseHTTPRequestHandler):
    server: LocalSite

    def do_GET(self) -> None:
        body = self.server.pages.get(urlsplit(self.path).path)
        self.send_response(404 if body is None else 200)
        self.send_header("Content-Type", "text/html; charset=utf-8")
        self.send_header("Content-Length", str(len(body or b"")))
        self.end_headers()
        self.wfile.write(body or b"")

    def log_message(self, *_: object) -> None:
        """Say nothing."""


@contextmanager
def serve_site() -> Iterator[LocalSite]:
    """Serve a site while the block runs."""
    with LocalSite() as site:
        thread = threading.Thread(target=site.serve_forever)
        thread.start()
        try:
            yield site
        finally:
            site.shutdown()
            thread.join()
