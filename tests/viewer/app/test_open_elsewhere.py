"""`iibr open` as a file manager runs it: one window shows what later starts are asked for."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest

from tests.forked_iibr import run_forked
from tests.viewer.conftest import DEADLINE_S, Opener, write_scene

OpenPhotos = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture
def photos(tmp_path: Path) -> dict[str, Path]:
    return {name: write_scene(tmp_path, name) for name in ("a", "b", "c")}


@pytest.fixture
def places(display: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, str]]:
    """The user's folders and display, in the environment. A socket's path must be short."""
    with tempfile.TemporaryDirectory() as folder:
        found = {"DISPLAY": display, "XDG_RUNTIME_DIR": folder, "XDG_CONFIG_HOME": str(tmp_path / "config")}
        for name, value in found.items():
            monkeypatch.setenv(name, value)
        yield found


@pytest.fixture
def open_photos(places: dict[str, str], tmp_path: Path) -> OpenPhotos:
    """The program has no path, and so no dialog that would wait for a person."""
    return lambda *paths: run_forked("open", *paths, cwd=tmp_path, **places, PATH="")


def test_later_starts_open_their_photos_in_the_window_that_is_there(
    open_photos: OpenPhotos, open_window: Opener, photos: dict[str, Path]
) -> None:
    driver = open_window(photos["a"])
    driver.until_idle()
    driver.app.receiver.listen()
    for paths, shown in ((["b"], "b"), (["c", "a", "b"], "c"), ([], "c")):
        assert open_photos(*(photos[name] for name in paths)).returncode == 0
        driver.until(lambda app, name=shown: app.state.scene.name == name)  # type: ignore[misc]
        driver.until_idle()
    refused = open_photos(photos["a"], "gone.png")
    assert (refused.returncode, "gone.png: no such file" in refused.stderr) == (2, True)
    driver.until_idle()
    assert driver.app.state.scene is not None
    assert driver.app.state.scene.name == "c"


def window_of(title: str) -> str:
    found = ["xdotool", "search", "--sync", "--onlyvisible", "--name", title]
    return subprocess.run(found, check=True, timeout=DEADLINE_S, capture_output=True, text=True).stdout


def test_a_window_that_was_killed_is_not_waited_for(open_photos: OpenPhotos, photos: dict[str, Path]) -> None:
    command = [sys.executable, "-P", "-m", "viewer", "open", photos["a"]]
    with subprocess.Popen(command, env=os.environ) as killed:
        window_of("^a - iibr$")
        killed.kill()
    with subprocess.Popen(command, env=os.environ) as program:
        try:
            window = window_of("^a - iibr$")
            assert program.poll() is None
            assert open_photos(photos["b"]).returncode == 0
            assert window_of("^b - iibr$") == window
        finally:
            program.terminate()
