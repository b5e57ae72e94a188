"""WebKitGTK, the engine of Safari on Linux, driven by WebKitWebDriver over HTTP."""

import http.client
import json
import shutil
import socket
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

from tests.browsers.page import DEADLINE_S, Page, PageError, as_json, required, run_program, wait_for

BROWSERS = ("/usr/lib/*/webkit2gtk-4.1/MiniBrowser", "/usr/lib*/webkit2gtk-4.1/MiniBrowser")
COMMANDS = {
    "Navigate": ("POST", "/url"),
    "ExecuteAsyncScript": ("POST", "/execute/async"),
    "TakeScreenshot": ("GET", "/screenshot"),
    "PerformActions": ("POST", "/actions"),
    "SetWindowRect": ("POST", "/window/rect"),
    "DeleteSession": ("DELETE", ""),
}
"""Method and path of the commands by name."""
MIN_WIDTH = 447
"""Smallest width of a window, CSS pixels."""
GTK_SETTINGS = "[Settings]\ngtk-enable-animations=0\n"
"""Settings by which pages prefer reduced motion."""


class WebKitPage(Page):
    """The page of a WebKitGTK."""

    def resize(self, width: int, height: int) -> None:
        """Set the size of the page; its width is at least MIN_WIDTH."""
        width = max(width, MIN_WIDTH)
        across, down = self.evaluate("[outerWidth - innerWidth, outerHeight - innerHeight]")
        self.call("SetWindowRect", {"width": width + across, "height": height + down})
        self.wait_until(f"innerWidth === {width} && innerHeight === {height}")


class Driver:
    """A session of WebKitWebDriver."""

    def __init__(self, port: int, capabilities: Mapping[str, Any]) -> None:
        self._connection = http.client.HTTPConnection("127.0.0.1", port, timeout=2 * DEADLINE_S)
        session = self._ask("POST", "/session", {"capabilities": {"alwaysMatch": capabilities}})
        self._root = f"/session/{session['sessionId']}"

    def call(self, name: str, parameters: Mapping[str, Any]) -> Any:
        """Run a command of COMMANDS. Raises PageError if it fails."""
        method, path = COMMANDS[name]
        return self._ask(method, self._root + path, parameters if method == "POST" else None)

    def _ask(self, method: str, path: str, parameters: Mapping[str, Any] | None) -> Any:
        self._connection.request(method, path, None if parameters is None else as_json(parameters))
        with self._connection.getresponse() as response:
            value = json.loads(response.read())["value"]
        if response.status != http.client.OK:
            raise PageError(f"{path}: {value['message']}")
        return value

    def close(self) -> None:
        """End the session and its browser."""
        with suppress(PageError, OSError, http.client.HTTPException):
            self.call("DeleteSession", {})
        self._connection.close()


@contextmanager
def open_webkit(display: str, proxy_port: int) -> Iterator[WebKitPage]:
    """Start WebKitGTK's MiniBrowser on an X display; yield its page. All requests by HTTP go to the proxy."""
    program = required(shutil.which("WebKitWebDriver"), "webkit2gtk-driver")
    browser = required(next((str(path) for pattern in BROWSERS for path in Path("/").glob(pattern[1:])), None), program)
    proxy = {"proxyType": "manual", "httpProxy": f"127.0.0.1:{proxy_port}", "sslProxy": f"127.0.0.1:{proxy_port}"}
    capabilities = {
        "webkitgtk:browserOptions": {"binary": browser, "args": ["--automation"]},
        "proxy": proxy,
        "timeouts": {"script": int(2000 * DEADLINE_S)},
    }
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        (folder / "gtk-3.0").mkdir()
        (folder / "gtk-3.0" / "settings.ini").write_text(GTK_SETTINGS)
        port = _free_port()
        with run_program([program, f"--port={port}"], folder, display) as process:
            wait_for(lambda: _is_open(port), process)
            driver = Driver(port, capabilities)
            try:
                yield WebKitPage(driver.call, folder)
            finally:
                driver.close()


def _free_port() -> int:
    with socket.create_server(("127.0.0.1", 0)) as server:
        return int(server.getsockname()[1])


def _is_open(port: int) -> bool:
    try:
        socket.create_connection(("127.0.0.1", port), DEADLINE_S).close()
    except ConnectionRefusedError:
        return False
    return True
