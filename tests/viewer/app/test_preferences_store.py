"""Preferences and recent files on disk: round trip, damage, and places where nothing can be written."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from tests.viewer.conftest import reduce
from viewer.app.preferences_store import (
    PREFERENCES_FILE,
    RECENT_FILE,
    PreferencesKeeper,
    last_opened,
    load_preferences,
    store_preferences,
)
from viewer.model import preferences, tracking
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.preferences import FONT_SCALE_LIMITS, Preferences
from viewer.model.tracking import HEAD_RANGE_LIMITS


def test_kept_values_come_back(tmp_path):
    state = AppState(recent=("/photos/ä.png", "b.png"))
    for action in (
        do(preferences.set_theme, "light"),
        do(preferences.set_font_scale, 1.5),
        do(preferences.toggle_section, "scene"),
        do(preferences.place_window, (10, 20, 900, 700)),
        do(preferences.place_window, None),
        do(tracking.switch, "udp:5000"),
        do(tracking.set_head_range, 25.0),
    ):
        state = reduce(state, action)
    folder = tmp_path / "not" / "there" / "yet"
    store_preferences(state, folder)
    again = load_preferences(AppState(), folder)
    assert again.preferences == state.preferences
    assert again.preferences.open_sections == ("more", "advanced", "scene")
    assert (again.preferences.window, again.preferences.is_maximized) == ((10, 20, 900, 700), True)
    assert (again.preferences.tracker, again.preferences.head_range_cm) == ("udp:5000", 25.0)
    assert again.recent == ("/photos/ä.png", str(Path("b.png").absolute()))
    assert load_preferences(AppState(), tmp_path) == AppState(), "nothing is kept there"


def test_the_last_file_is_known_as_long_as_it_exists(tmp_path):
    photo = tmp_path / "photo.png"
    photo.touch()
    assert last_opened(tmp_path) is None, "nothing is kept"
    store_preferences(replace(AppState(), recent=(str(photo), str(tmp_path))), tmp_path)
    assert last_opened(tmp_path) == str(photo)
    photo.unlink()
    assert last_opened(tmp_path) is None, "another one is not what was open last"


@pytest.mark.parametrize("damage", [b"", b"{", b"\xff\xfe\x00", b"[" * 50_000, b'"text"', b'{"theme": "purple"}'])
def test_damaged_files_give_a_notice_each_and_the_usual_values(tmp_path, damage):
    (tmp_path / PREFERENCES_FILE).write_bytes(damage)
    (tmp_path / RECENT_FILE).write_bytes(damage)
    state = load_preferences(AppState(), tmp_path)
    assert state.preferences == Preferences()
    assert state.recent == ()
    assert [PREFERENCES_FILE in n.text for n in state.notices] == [True, False]
    assert RECENT_FILE in state.notices[1].text


def test_values_of_other_versions_are_left_out_and_too_large_ones_limited(tmp_path):
    kept = {
        "theme": "light",
        "font_scale": 1e9,
        "language": "de",
        "last_folder": str(tmp_path / "gone"),
        "opened_folder": str(tmp_path / "gone"),
        "head_range_cm": -1,
    }
    (tmp_path / PREFERENCES_FILE).write_text(json.dumps(kept))
    state = load_preferences(AppState(), tmp_path)
    assert state.preferences == Preferences("light", FONT_SCALE_LIMITS[1], head_range_cm=HEAD_RANGE_LIMITS[0])
    assert state.notices == ()


def test_who_has_no_home_folder_is_not_asked_to_choose_another(tmp_path):
    (tmp_path / "file").touch()
    keeper = PreferencesKeeper(AppState(), tmp_path / "file" / "folder")
    (notice,) = reduce(AppState(), keeper.keep(AppState())[0]).notices
    assert notice.text.startswith("Settings and recent photos are not kept. ")
    assert notice.is_error
    assert "choose" not in notice.text
