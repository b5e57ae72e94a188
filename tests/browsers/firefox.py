"""Firefox, driven by its protocol Marionette: https://firefox-source-docs.mozilla.org/testing/marionette/Protocol.html."""

import json
import shutil
import socket
import tempfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from tests.browsers.page import DEADLINE_S, Page, PageError, as_json, required, run_program, wait_for

NAMES = ("firefox-esr", "firefox")
PREFERENCES = {
    "browser.download.folderList": 2,
    "marionette.port": 0,
    "network.proxy.type": 1,
    "ui.prefersReducedMotion": 1,
}
"""The folder of kind 2 and the proxy of type 1 are those named; port 0 stands for any free one."""
SIZE_SCRIPT = """
const [width, height] = arguments, { style } = gBrowser.selectedBrowser;
style.minWidth = style.maxWidth = `${width}px`;
style.minHeight = style.maxHeight = `${height}px`;
"""


class FirefoxPage(Page):
    """The page of a Firefox, which takes any size."""

    def resize(self, width: int, height: int) -> None:
        self.call("Marionette:SetContext", {"value": "chrome"})
        self.call("WebDriver:ExecuteScript", {"script": SIZE_SCRIPT, "args": [width, height]})
        self.call("Marionette:SetContext", {"value": "content"})
        self.wait_until(f"innerWidth === {width} && innerHeight === {height}")


class Marionette:
    """A connection: messages are JSON behind their length."""

    def __init__(self, port: int) -> None:
        self._socket = socket.create_connection(("127.0.0.1", port), DEADLINE_S)
        self._socket.settimeout(2 * DEADLINE_S)  # conditions in the page end by themselves
        self._answers = self._socket.makefile("rb")
        self._count = 0
        self._read()

    def call(self, name: str, parameters: Mapping[str, Any]) -> Any:
        """Run a command, of WebDriver unless its domain is given. Raises PageError if it fails."""
        self._count += 1
        data = as_json([0, self._count, name if ":" in name else f"WebDriver:{name}", parameters])
        self._socket.sendall(b"%d:%s" % (len(data), data))
        _, _, error, result = self._read()
        if error:
            raise PageError(f"{name}: {error['message']}")
        return result["value"] if isinstance(result, dict) and set(result) == {"value"} else result

    def _read(self) -> Any:
        length = b""
        while not length.endswith(b":"):
            letter = self._answers.read(1)
            if not letter:
                raise PageError("Firefox has ended")
            length += letter
        return json.loads(self._answers.read(int(length[:-1])))

    def close(self) -> None:
        """End the connection."""
        self._answers.close()
        self._socket.close()


@contextmanager
def open_firefox(display: str, proxy_port: int) -> Iterator[FirefoxPage]:
    """Start Firefox on an X display; yield its page. All requests by HTTP go to the proxy."""
    program = required(next(filter(None, map(shutil.which, NAMES)), None), NAMES[0])
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as name:
        folder = Path(name)
        (folder / "user.js").write_text(_preferences(folder, proxy_port))
        command = [program, "--marionette", "--remote-allow-system-access", "--kiosk", "--profile", name]
        with run_program(command, folder, display) as process:
            file = folder / "MarionetteActivePort"
            connection = Marionette(int(wait_for(lambda: file.exists() and file.read_text(), process)))
            try:
                connection.call("NewSession", {"timeouts": {"script": 2000 * DEADLINE_S}})
                yield FirefoxPage(connection.call, folder)
            finally:
                connection.close()


def _preferences(downloads: Path, proxy_port: int) -> str:
    proxies = {f"network.proxy.{kind}": "127.0.0.1" for kind in ("http", "ssl")}
    ports = {f"{name}_port": proxy_port for name in proxies}
    settings = {**PREFERENCES, **proxies, **ports, "browser.download.dir": str(downloads)}
    return "".join(f"user_pref({json.dumps(name)}, {json.dumps(value)});\n" for name, value in settings.items())
