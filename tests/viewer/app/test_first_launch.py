"""The first minute in a real window: the welcome, the demo, and the photo that was open last."""

import os
import subprocess
import sys

import pytest

from tests.viewer.conftest import DEADLINE_S, write_scene
from viewer.app.preferences_store import store_preferences
from viewer.model.app_state import AppState
from viewer.model.browsing import PathPrompt
from viewer.model.preferences import Preferences


def test_an_empty_window_offers_to_open_a_photo_and_to_see_the_demo(open_window, no_dialogs, tmp_path):
    store_preferences(AppState(preferences=Preferences(opened_folder=str(tmp_path))), tmp_path / "kept")
    driver = open_window(None, kept_in=tmp_path / "kept")
    driver.press("Open a photo…", "welcome")
    driver.until(lambda app: isinstance(app.state.prompt, PathPrompt))
    assert driver.app.state.prompt.path == os.path.join(tmp_path, "")
    driver.send("key", "Escape")
    driver.until(lambda app: app.state.prompt is None)
    driver.press("See the demo", "welcome")
    driver.until(lambda app: app.state.scene is not None)
    assert driver.app.state.scene.name == "motorcycle"
    assert driver.app.state.preferences.opened_folder == str(tmp_path), "the user's own folder"


def test_a_click_opens_a_recent_photo_and_photos_that_are_gone_are_not_shown(open_window, photo_path, tmp_path):
    gone, other = str(tmp_path / "gone.png"), str(write_scene(tmp_path, "other"))
    state = AppState(recent=(gone, str(photo_path), other), preferences=Preferences(open_sections=("more",)))
    store_preferences(state, tmp_path / "kept")
    driver = open_window(None, kept_in=tmp_path / "kept")
    driver.until(lambda app: app.state.existing_recent == (str(photo_path), other))
    driver.press(f"photo {photo_path}", "welcome")
    driver.until(lambda app: app.state.scene is not None)
    assert driver.app.state.scene.name == "scene"
    assert driver.app.state.preferences.opened_folder == str(photo_path.parent)
    assert driver.app.state.recent == (str(photo_path), gone, other), "its disk may be back the next time"
    driver.until_idle()
    driver.press(f"other.png##{other}")
    driver.until(lambda app: app.state.scene.name == "other")


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
