"""The first minute in a real window: the welcome, the demo that sways until it is touched, and what is kept of it."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from iibr_core.beyond.optics import CENTRE
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape
from tests.viewer.conftest import DEADLINE_S, Driver, Opener
from viewer.app.preferences_store import store_preferences
from viewer.app.reduced_motion import prefers_reduced_motion
from viewer.model.actions import OpenPath
from viewer.model.state.app_state import AppState


@pytest.fixture
def no_settings(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> Path:
    """A desktop whose settings nobody can read; the folder where programs are looked for that could."""
    programs = tmp_path / "bin"
    programs.mkdir()
    monkeypatch.setenv("PATH", str(programs), prepend=os.pathsep)
    answer_settings(programs, "")
    return programs


def answer_settings(programs: Path, answer: str) -> None:
    """As GNOME's and macOS's programs."""
    for name in ("gsettings", "defaults"):
        (programs / name).write_text(f"#!/bin/sh\necho {answer}\n")
        (programs / name).chmod(0o755)


def open_demo(open_window: Opener, photo: Path, kept: Path) -> Driver:
    """On a small scene in place of the demo's photo."""
    driver = open_window(None, kept_in=kept)
    driver.app.do(OpenPath(Source(str(photo), grid=GridShape(3, 3)), is_demo=True))
    return driver


def test_the_demo_sways_until_a_key_is_pressed_whatever_it_is(
    open_window: Opener, photo_path: Path, tmp_path: Path, no_settings: Path
) -> None:
    driver = open_demo(open_window, photo_path, tmp_path / "kept")
    driver.until(lambda app: app.state.optics.eye != CENTRE)
    assert driver.app.state.progress.is_complete
    assert driver.app.state.optics.aperture_diameter > 0
    assert not driver.app.state.notices
    driver.send("mousemove", *driver.position(0.2, 0.2))
    driver.until(lambda app: app.state.hover is not None)
    assert driver.app.state.motion.kind == "sway", "to move the mouse is no touch"
    driver.send("key", "shift")
    driver.until(lambda app: not app.state.awaits_touch)
    eye = driver.app.state.optics.eye
    driver.until_idle()
    assert driver.app.state.optics.eye == eye != CENTRE


@pytest.mark.parametrize("touch", [("click", 1), ("click", 3), ("click", 4)], ids=("click", "right click", "wheel"))
def test_the_mouse_stops_it_over_the_panel_too(
    open_window: Opener, photo_path: Path, tmp_path: Path, no_settings: Path, touch: tuple[object, ...]
) -> None:
    driver = open_demo(open_window, photo_path, tmp_path / "kept")
    driver.until(lambda app: app.state.motion.kind == "sway")
    panel = driver.app.layout().panel
    driver.send("mousemove", round(panel.x + panel.width / 2), round(panel.y + panel.height - 4))
    driver.send(*touch)
    driver.until(lambda app: app.state.motion.kind is None and not app.state.awaits_touch)


def test_closed_while_it_sways_nothing_is_kept(
    open_window: Opener, photo_path: Path, tmp_path: Path, no_settings: Path
) -> None:
    driver = open_demo(open_window, photo_path, tmp_path / "kept")
    driver.until(lambda app: app.state.keeps_sessions and app.state.optics.eye != CENTRE)
    driver.close()
    assert not list((tmp_path / "kept").glob("sessions/*"))


def test_it_stands_still_where_the_desktop_asks_for_less_motion(
    open_window: Opener, photo_path: Path, tmp_path: Path, no_settings: Path
) -> None:
    assert not prefers_reduced_motion()
    for answer in ("false", "1"):
        answer_settings(no_settings, answer)
        if prefers_reduced_motion():
            break
    else:
        pytest.skip("no program is asked on this system")
    driver = open_demo(open_window, photo_path, tmp_path / "kept")
    driver.until(lambda app: app.state.progress.is_complete and not app.state.awaits_touch)
    driver.until_idle()
    assert driver.app.state.optics.eye == CENTRE
    assert driver.app.state.optics.aperture_diameter > 0


def test_an_empty_window_offers_to_open_a_photo_and_to_see_the_demo(
    open_window: Opener, no_dialogs: None, tmp_path: Path
) -> None:
    driver = open_window(None, kept_in=tmp_path / "kept")
    driver.press("Open a photo…", "welcome")
    driver.until(lambda app: app.state.prompt is not None)
    driver.send("key", "Escape")
    driver.until(lambda app: app.state.prompt is None)
    driver.press("See the demo", "welcome")
    driver.until(lambda app: app.state.scene is not None)
    assert driver.app.state.scene is not None
    assert driver.app.state.scene.name == "motorcycle"
    assert driver.app.state.awaits_touch


@pytest.mark.parametrize(
    ("recent", "title"), [(("scene.png",), "^scene - iibr$"), (("gone.png", "scene.png"), "^iibr$"), ((), "^iibr$")]
)
def test_iibr_alone_opens_what_was_open_last_or_an_empty_window(
    display: str, photo_path: Path, tmp_path: Path, recent: tuple[str, ...], title: str
) -> None:
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
