"""A page in a browser that speaks WebDriver (https://www.w3.org/TR/webdriver2), and how browsers are started."""

import base64
import json
import os
import signal
import subprocess
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

DEADLINE_S = 100.0
"""Time limit of a condition that always comes true."""
POLL_S = 0.02
"""Pause between two looks at what a browser does."""
KEYS = {name: chr(0xE011 + i) for i, name in enumerate(("Home", "ArrowLeft", "ArrowUp", "ArrowRight", "ArrowDown"))}
"""Characters of WebDriver for keys that write none."""
PNG_END = b"IEND\xaeB`\x82"

Place = tuple[float, float]


class PageError(RuntimeError):
    """An error of a page or of the browser."""


class Page:
    """A page, driven by WebDriver's commands. Places are CSS pixels from its upper left corner.

    call: runs a command, named as Marionette names it. downloads: folder of the files that the page saves.
    """

    SCRIPT = (
        "const done = arguments[arguments.length - 1]; Promise.resolve().then(() => ({expression}))"
        ".then(value => done({{ value }}), error => done({{ error: `${{error}}` }}))"
    )

    def __init__(self, call: Callable[[str, Mapping[str, Any]], Any], downloads: Path) -> None:
        self.call, self.downloads = call, downloads

    def open(self, url: str) -> None:
        """Load a page and wait for its load event."""
        self.call("Navigate", {"url": url})

    def evaluate(self, expression: str) -> Any:
        """Return the value of a JavaScript expression, awaited. Raises PageError for what it throws."""
        script = self.SCRIPT.format(expression=expression)
        answer = self.call("ExecuteAsyncScript", {"script": script, "args": []})
        if "error" in answer:
            raise PageError(answer["error"])
        return answer.get("value")

    def screenshot(self) -> bytes:
        """Return what the page shows as a PNG file."""
        return base64.b64decode(self.call("TakeScreenshot", {"full": False}))

    def press(self, key: str, times: int = 1) -> None:
        """Press and release a key, named as events name it."""
        kinds = ("keyDown", "keyUp")
        self._perform("key", [{"type": kind, "value": KEYS.get(key, key)} for _ in range(times) for kind in kinds])

    def drag(self, *places: Place) -> None:
        """Press the left button at the first place, move to the others, and release it; one place is a click."""
        moves = [{"type": "pointerMove", "x": round(x), "y": round(y), "duration": 0} for x, y in places]
        down, up = ({"type": kind, "button": 0} for kind in ("pointerDown", "pointerUp"))
        self._perform("pointer", [moves[0], down, *moves[1:], up])

    def _perform(self, kind: str, actions: Sequence[Mapping[str, Any]]) -> None:
        self.call("PerformActions", {"actions": [{"type": kind, "id": kind, "actions": actions}]})

    def wait_until(self, condition: str) -> None:
        """Ask a JavaScript condition once a frame until it holds.

        Raises PageError with the page's text after DEADLINE_S.
        """
        self.evaluate(
            "new Promise((done, fail) => { const end = performance.now() + "
            f"{1000 * DEADLINE_S}, ask = () => {condition} ? done() : performance.now() > end"
            " ? fail(new Error(document.body.innerText)) : requestAnimationFrame(ask); ask() })"
        )

    def saved_png(self, name: str) -> bytes:
        """Return a PNG file that the page saved, as soon as it is whole."""
        file = self.downloads / name
        wait_for(lambda: file.exists() and file.read_bytes().endswith(PNG_END))
        return file.read_bytes()


@contextmanager
def run_program(command: Sequence[str], folder: Path, display: str) -> Iterator[subprocess.Popen[bytes]]:
    """Run a browser that keeps all its files in `folder`; end it and every program it started."""
    places = {name: str(folder) for name in ("HOME", "XDG_CONFIG_HOME", "XDG_CACHE_HOME", "XDG_DATA_HOME")}
    environment = {**os.environ, **places, "XDG_RUNTIME_DIR": str(folder), "DISPLAY": display, "NO_AT_BRIDGE": "1"}
    environment.pop("WAYLAND_DISPLAY", None)
    with (folder / "log").open("wb") as log:
        process = subprocess.Popen(command, env=environment, stdout=log, stderr=log, start_new_session=True)
    try:
        yield process
    finally:
        os.killpg(process.pid, signal.SIGKILL)
        process.wait()


def wait_for(look: Callable[[], Any], process: subprocess.Popen[bytes] | None = None) -> Any:
    """Repeat `look` until it returns a true value, which is returned.

    Raises RuntimeError after DEADLINE_S, or when a process has ended.
    """
    end = time.monotonic() + DEADLINE_S
    while not (value := look()):
        if time.monotonic() > end or (process is not None and process.poll() is not None):
            raise RuntimeError("the browser has ended, or does nothing")
        time.sleep(POLL_S)
    return value


def required(program: str | None, package: str) -> str:
    """Return the path of a program. Raises RuntimeError if it is missing: `make test` installs it."""
    if program is None:
        raise RuntimeError(f"install {package}: tests of web pages need it")
    return program


def as_json(value: Any) -> bytes:
    """Return a value as JSON."""
    return json.dumps(value).encode()
