"""`iibr open` as a file manager runs it: one window shows what later starts are asked for."""

import socket
import subprocess
import sys
import tempfile

import pytest

from tests.forked_iibr import run_forked
from tests.viewer.conftest import DEADLINE_S, write_scene
from viewer.app.handover import window_address


@pytest.fixture
def photos(tmp_path):
    return {name: write_scene(tmp_path, name) for name in ("a", "b", "c")}


@pytest.fixture
def open_photos(display, tmp_path, monkeypatch):
    """The user has new folders; a socket's path must be short. Without PATH there is no dialog to wait for a person."""
    with tempfile.TemporaryDirectory() as folder:
        monkeypatch.setenv("XDG_RUNTIME_DIR", folder)
        monkeypatch.setenv("XDG_CONFIG_HOME", str(tmp_path / "config"))
        yield lambda *paths: run_forked("open", *paths, cwd=tmp_path, DISPLAY=display, PATH="")


def test_later_starts_open_their_photos_in_the_window_that_is_there(open_photos, open_window, photos):
    driver = open_window(photos["a"])
    driver.until_idle()
    driver.app.receiver.listen()
    for paths, shown in ((["b"], "b"), (["c", "a", "b"], "c"), ([], "c")):
        assert open_photos(*(photos[name] for name in paths)).returncode == 0
        driver.settle(lambda app, name=shown: app.state.scene.name == name)
    refused = open_photos(photos["a"], "gone.png")
    assert (refused.returncode, "gone.png: no such file" in refused.stderr) == (2, True)
    driver.until_idle()
    assert driver.app.state.scene.name == "c"


def window_of(title):
    found = ["xdotool", "search", "--sync", "--onlyvisible", "--name", title]
    return subprocess.run(found, check=True, timeout=DEADLINE_S, capture_output=True, text=True).stdout


def test_a_window_that_was_killed_is_not_waited_for(open_photos, photos):
    with socket.socket(socket.AF_UNIX) as left:
        left.bind(window_address() or "")
    with subprocess.Popen([sys.executable, "-P", "-m", "viewer", "open", photos["a"]]) as program:
        try:
            window = window_of("^a - iibr$")
            assert program.poll() is None
            assert open_photos(photos["b"]).returncode == 0
            assert window_of("^b - iibr$") == window
        finally:
            program.terminate()
