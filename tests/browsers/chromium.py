"""A real browser without a window, for tests and benchmarks of pages: Chromium, by its DevTools protocol over a pipe.

https://chromedevtools.github.io/devtools-protocol; messages end with a zero byte (`--remote-debugging-pipe`).
"""

from __future__ import annotations

import base64
import json
import os
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from tests.browsers.page import Page, PageError, Place, required

NAMES = ("chromium", "chromium-browser", "google-chrome")
USUAL_FLAGS = (
    "--headless=new", "--no-sandbox", "--no-first-run", "--disable-background-networking", "--disable-component-update",
    "--disable-default-apps", "--disable-extensions", "--disable-sync", "--hide-scrollbars", "--mute-audio",
    "--force-color-profile=srgb",
)  # fmt: skip
SOFTWARE = ("--use-gl=angle", "--use-angle=swiftshader", "--enable-unsafe-swiftshader")
"""WebGL on the processor."""

AS_3_AND_4 = """
import fcntl, os, sys
ends = [fcntl.fcntl(int(end), fcntl.F_DUPFD, 10) for end in sys.argv[1:3]]
for number, end in enumerate(ends, start=3):
    os.dup2(end, number)
os.execvp(sys.argv[3], sys.argv[3:])
"""
"""A program that becomes another, which finds the two descriptors named where the protocol wants them."""


KEY_CODES = {"ArrowLeft": 37, "ArrowUp": 38, "ArrowRight": 39, "ArrowDown": 40, "Home": 36}


class Tab(Page):
    """One page. events: what it told so far, the latest last, by (method, parameters)."""

    def __init__(self, pipe: Pipe, session: str) -> None:
        self._pipe, self._session = pipe, session
        self.events: list[tuple[str, dict[str, Any]]] = []
        pipe.tabs[session] = self
        for domain in ("Page", "Runtime", "Network", "Log"):
            self.call(f"{domain}.enable")

    def call(self, method: str, **parameters: Any) -> dict[str, Any]:
        """A command of the protocol. Raises PageError where it fails."""
        return self._pipe.call(method, parameters, self._session)

    def open(self, url: str) -> None:
        """Load a page and wait for its load event."""
        self.events.clear()
        self.call("Page.navigate", url=url)
        self.wait_for("Page.loadEventFired")

    def wait_for(self, method: str) -> dict[str, Any]:
        """The next event of this name, or one that came already."""
        while True:
            for name, parameters in self.events:
                if name == method:
                    return parameters
            self._pipe.read()

    def evaluate(self, expression: str) -> Any:
        """The value of a JavaScript expression, awaited. Raises PageError for what it throws."""
        answer = self.call("Runtime.evaluate", expression=expression, awaitPromise=True, returnByValue=True)
        if "exceptionDetails" in answer:
            details = answer["exceptionDetails"]
            raise PageError(details.get("exception", {}).get("description") or details["text"])
        return answer["result"].get("value")

    def resize(self, width: int, height: int, ratio: float = 1.0, is_phone: bool = False) -> None:
        """The size of the page, CSS pixels. is_phone: with touch instead of a mouse."""
        self.call(
            "Emulation.setDeviceMetricsOverride", width=width, height=height, deviceScaleFactor=ratio, mobile=is_phone
        )
        self.call("Emulation.setTouchEmulationEnabled", enabled=is_phone)

    def screenshot(self) -> bytes:
        return base64.b64decode(self.call("Page.captureScreenshot", format="png")["data"])

    def press(self, key: str, times: int = 1) -> None:
        for _ in range(times):
            for kind in ("keyDown", "keyUp"):
                code = KEY_CODES.get(key, 0)
                self.call("Input.dispatchKeyEvent", type=kind, key=key, windowsVirtualKeyCode=code)

    def drag(self, *places: Place) -> None:
        kinds = ["mousePressed", *["mouseMoved"] * (len(places) - 1), "mouseReleased"]
        for kind, (x, y) in zip(kinds, [*places, places[-1]], strict=True):
            self.call("Input.dispatchMouseEvent", type=kind, x=x, y=y, button="left", clickCount=1)

    def prefer(self, **features: str) -> None:
        """Media features, as prefers_color_scheme="dark"."""
        media = [{"name": name.replace("_", "-"), "value": value} for name, value in features.items()]
        self.call("Emulation.setEmulatedMedia", features=media)

    @property
    def requests(self) -> list[str]:
        """The addresses of all that was asked for since the page was opened, but for the page, what it holds, and what
        its policy stopped before it left.
        """
        stopped = {event["requestId"] for _, event in self.events if event.get("blockedReason") == "csp"}
        asked = [event for name, event in self.events if name == "Network.requestWillBeSent"]
        urls = [event["request"]["url"] for event in asked[1:] if event["requestId"] not in stopped]
        return [url for url in urls if not url.startswith(("data:", "blob:"))]

    @property
    def complaints(self) -> list[str]:
        """Errors on the console, exceptions that nobody caught, and what the policy forbade."""
        thrown = [event["exceptionDetails"] for name, event in self.events if name == "Runtime.exceptionThrown"]
        logged = [event["entry"] for name, event in self.events if name == "Log.entryAdded"]
        return [*map(json.dumps, thrown), *(entry["text"] for entry in logged if entry["level"] == "error")]

    def close(self) -> None:
        with suppress(PageError):
            self.call("Page.close")
        self._pipe.tabs.pop(self._session, None)


class Pipe:
    """The browser's end of the protocol."""

    def __init__(self, to: IO[bytes], answers: IO[bytes]) -> None:
        self._to, self._answers, self._count, self._rest = to, answers, 0, b""
        self._done: dict[int, dict[str, Any]] = {}
        self.tabs: dict[str, Tab] = {}

    def call(self, method: str, parameters: dict[str, Any], session: str | None = None) -> dict[str, Any]:
        self._count += 1
        number = self._count
        message = {"id": number, "method": method, "params": parameters} | ({"sessionId": session} if session else {})
        self._to.write(json.dumps(message).encode() + b"\0")
        self._to.flush()
        while number not in self._done:
            self.read()
        answer = self._done.pop(number)
        if "error" in answer:
            raise PageError(f"{method}: {answer['error']['message']}")
        return answer["result"]

    def read(self) -> None:
        while b"\0" not in self._rest:
            data = os.read(self._answers.fileno(), 1 << 20)
            if not data:
                raise PageError("the browser has ended")
            self._rest += data
        text, _, self._rest = self._rest.partition(b"\0")
        message = json.loads(text)
        if "id" in message:
            self._done[message["id"]] = message
        elif tab := self.tabs.get(message.get("sessionId")):
            tab.events.append((message["method"], message["params"]))

    def save_to(self, folder: Path) -> None:
        """Save downloads of all pages in a folder."""
        self.call("Browser.setDownloadBehavior", {"behavior": "allow", "downloadPath": str(folder)})

    def new_tab(self) -> Tab:
        """An empty page of its own."""
        target = self.call("Target.createTarget", {"url": "about:blank"})["targetId"]
        return Tab(self, self.call("Target.attachToTarget", {"targetId": target, "flatten": True})["sessionId"])


@contextmanager
def open_browser(*flags: str) -> Iterator[Pipe]:
    """A browser with a profile of its own. flags: besides the usual ones, those of SOFTWARE if none are given.

    Raises RuntimeError where there is none: `make test` installs it.
    """
    program = required(next(filter(None, map(shutil.which, NAMES)), None), NAMES[0])
    with tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder:
        (read, their_write), (their_read, write) = os.pipe(), os.pipe()
        command = [program, *USUAL_FLAGS, *(flags or SOFTWARE), f"--user-data-dir={folder}", "--remote-debugging-pipe"]
        shell = [sys.executable, "-c", AS_3_AND_4, str(their_read), str(their_write), *command, "about:blank"]
        with (Path(folder) / "log").open("wb") as log:
            process = subprocess.Popen(shell, pass_fds=(their_read, their_write), stdout=log, stderr=log)
        os.close(their_read)
        os.close(their_write)
        with os.fdopen(write, "wb") as to, os.fdopen(read, "rb", buffering=0) as answers:
            pipe = Pipe(to, answers)
            try:
                yield pipe
            finally:
                with suppress(PageError, OSError):
                    pipe.call("Browser.close", {})
                process.wait()
