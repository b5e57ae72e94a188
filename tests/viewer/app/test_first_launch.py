"""The first minute in a real window, the photo that was open last, and later starts of the program."""

import os
import socket
import subprocess
import sys
import tempfile

import pytest

from tests.forked_iibr import run_forked
from tests.viewer.conftest import DEADLINE_S, shows, write_scene
from viewer.app.handover import window_address
from viewer.app.preferences_store import store_preferences
from viewer.model.app_state import AppState
from viewer.model.browsing import PathPrompt
from viewer.model.preferences import Preferences


def test_an_empty_window_offers_to_open_a_photo_and_to_see_the_demo(open_window, no_dialogs, tmp_path):
    store_preferences(AppState(preferences=Preferences(opened_folder=str(tmp_path))), tmp_path / "kept")
    driver = open_window(None, kept_in=tmp_path / "kept")
    driver.press("Open a photo…", "welcome", until=lambda app: isinstance(app.state.prompt, PathPrompt))
    assert driver.app.state.prompt.path == os.path.join(tmp_path, "")
    driver.key("Escape", until=lambda app: app.state.prompt is None)
    driver.press("See the demo", "welcome", until=lambda app: app.state.scene is not None)
    assert driver.app.state.scene.name == "motorcycle"
    assert driver.app.state.preferences.opened_folder == str(tmp_path), "the user's own folder"


def test_a_click_opens_a_recent_photo_and_photos_that_are_gone_are_not_shown(open_window, photo_path, tmp_path):
    gone, other = str(tmp_path / "gone.png"), str(write_scene(tmp_path, "other"))
    state = AppState(recent=(gone, str(photo_path), other), preferences=Preferences(open_sections=("more",)))
    store_preferences(state, tmp_path / "kept")
    driver = open_window(None, kept_in=tmp_path / "kept")
    driver.until(lambda app: app.state.existing_recent == (str(photo_path), other))
    driver.press(f"photo {photo_path}", "welcome", until=lambda app: app.state.scene is not None)
    assert driver.app.state.scene.name == "scene"
    assert driver.app.state.preferences.opened_folder == str(photo_path.parent)
    assert driver.app.state.recent == (str(photo_path), gone, other), "its disk may be back the next time"
    driver.until_idle()
    driver.press(f"other.png##{other}", until=shows("other"))


@pytest.mark.parametrize(
    ("recent", "title"), [(("scene.png",), "^scene - iibr$"), (("gone.png", "scene.png"), "^iibr$")]
)
def test_iibr_alone_opens_what_was_open_last_or_an_empty_window(display, photo_path, tmp_path, recent, title):
    folder = tmp_path / "config"
    store_preferences(AppState(recent=tuple(str(photo_path.with_name(name)) for name in recent)), folder / "iibr")
    environment = {**os.environ, "XDG_CONFIG_HOME": str(folder)}
    with subprocess.Popen([sys.executable, "-m", "viewer"], env=environment) as program:
        try:
            found = ["xdotool", "search", "--sync", "--onlyvisible", "--name", title]
            subprocess.run(found, check=True, timeout=DEADLINE_S, stdout=subprocess.DEVNULL)
            assert program.poll() is None
        finally:
            program.terminate()


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
    driver = open_window(photos["a"]).until_idle()
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
