"""Preferences and recent files on disk: round trip, damage, and places where nothing can be written."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import pytest

from iibr_core.types import InputError
from tests.viewer.model.test_reducers import scene_of, state_with
from viewer.app.preferences_store import PREFERENCES_FILE, RECENT_FILE, last_opened, load_preferences, store_preferences
from viewer.model.reducers.lens_reducer import APERTURE_OPENED
from viewer.model.reducers.root import reduce
from viewer.model.state.app_state import AppState
from viewer.model.state.optics_actions import FocusOn
from viewer.model.state.preferences import PlaceWindow, Preferences, SetPreference, ToggleSection
from viewer.model.window_limits import FONT_SCALE_LIMITS


def test_what_is_kept_comes_back(tmp_path: Path) -> None:
    state = AppState(recent=("/photos/ä.png", "b.png"))
    for action in (
        SetPreference("theme", "light"),
        SetPreference("font_scale", 1.5),
        ToggleSection("scene"),
        PlaceWindow((10, 20, 900, 700)),
    ):
        state = reduce(state, action)
    folder = tmp_path / "not" / "there" / "yet"
    store_preferences(state, folder)
    again = load_preferences(AppState(), folder)
    assert again.preferences == state.preferences
    assert again.preferences.open_sections == ("more", "advanced", "scene")
    assert again.recent == ("/photos/ä.png", str(Path("b.png").absolute()))
    assert sorted(path.name for path in folder.iterdir()) == [PREFERENCES_FILE, RECENT_FILE]


def test_what_was_told_once_is_not_told_by_the_next_process(tmp_path: Path) -> None:
    told = reduce(state_with(scene_of()), FocusOn((0.0, 0.0), -1.0))
    assert told.notices[-1].text == APERTURE_OPENED
    store_preferences(told, tmp_path)
    again = reduce(load_preferences(state_with(scene_of()), tmp_path), FocusOn((0.0, 0.0), -1.0))
    assert again.optics.aperture_diameter > 0
    assert not again.notices


def test_what_was_open_last_is_known_as_long_as_it_is_there(tmp_path: Path) -> None:
    photo = tmp_path / "photo.png"
    photo.touch()
    assert last_opened(tmp_path) is None, "nothing is kept"
    store_preferences(replace(AppState(), recent=(str(photo), str(tmp_path))), tmp_path)
    assert last_opened(tmp_path) == str(photo)
    photo.unlink()
    assert last_opened(tmp_path) is None, "another one is not what was open last"
    (tmp_path / RECENT_FILE).write_text('["a\\u0000b"]')
    assert last_opened(tmp_path) is None


def test_nothing_kept_is_no_news(tmp_path: Path) -> None:
    assert load_preferences(AppState(), tmp_path) == AppState()


@pytest.mark.parametrize("damage", [b"", b"{", b"\xff\xfe\x00", b"[" * 50_000, b"7", b'"text"'])
def test_damaged_files_give_a_notice_each_and_the_usual_values(tmp_path: Path, damage: bytes) -> None:
    (tmp_path / PREFERENCES_FILE).write_bytes(damage)
    (tmp_path / RECENT_FILE).write_bytes(damage)
    state = load_preferences(AppState(), tmp_path)
    assert state.preferences == Preferences()
    assert state.recent == ()
    assert [PREFERENCES_FILE in n.text for n in state.notices] == [True, False]
    assert RECENT_FILE in state.notices[1].text


@pytest.mark.parametrize(
    ("field", "value", "read", "is_told"),
    [
        ("theme", "purple", "dark", True),
        ("theme", ["light"], "dark", True),
        ("font_scale", 1e9, FONT_SCALE_LIMITS[1], False),
        ("font_scale", 10**400, FONT_SCALE_LIMITS[1], False),
        ("font_scale", float("nan"), 1.0, True),
        ("font_scale", "2", 1.0, True),
        ("font_scale", True, 1.0, True),
        ("font_scale", -3, 1.0, True),
        ("open_sections", ["scene", "kitchen", 7], ("scene",), True),
        ("open_sections", [["scene"], {}], (), True),
        ("open_sections", 3, Preferences().open_sections, True),
        ("window", [0, 0, 800, 600], (0, 0, 800, 600), False),
        ("window", [0, 0, 8, 6], None, False),
        ("window", [0, 0, 10**9, 600], None, False),
        ("window", [0.5, 0, 800, 600], None, True),
        ("window", "here", None, True),
    ],
)
def test_a_senseless_value_is_named_and_does_not_lose_the_others(
    tmp_path: Path, field: str, value: object, read: object, is_told: bool
) -> None:
    kept = {"theme": "light", "font_scale": 1.5, "open_sections": [], "window": None, field: value}
    (tmp_path / PREFERENCES_FILE).write_text(json.dumps(kept))
    state = load_preferences(AppState(), tmp_path)
    assert getattr(state.preferences, field) == read
    assert [field in notice.text and PREFERENCES_FILE in notice.text for notice in state.notices] == [True] * is_told
    if field != "theme":
        assert state.preferences.theme == "light"


def test_what_a_later_program_keeps_is_named_and_the_rest_counts(tmp_path: Path) -> None:
    (tmp_path / PREFERENCES_FILE).write_text(json.dumps({"theme": "light", "language\n": "de"}))
    state = load_preferences(AppState(), tmp_path)
    assert state.preferences == Preferences(theme="light")
    (notice,) = state.notices
    assert "left out: language;" in notice.text
    assert "\n" not in notice.text


def test_a_file_written_before_is_read_without_a_word(tmp_path: Path) -> None:
    (tmp_path / PREFERENCES_FILE).write_text(
        '{\n "theme": "light",\n "font_scale": 1.5,\n "open_sections": [\n  "view",\n  "scene"\n ],'
        '\n "window": [\n  10,\n'
        "  20,\n  900,\n  700\n ]\n}"
    )
    state = load_preferences(AppState(), tmp_path)
    assert state.preferences == Preferences("light", 1.5, ("view", "scene"), (10, 20, 900, 700))
    assert state.notices == ()


def test_halves_of_characters_in_recent_paths_are_replaced(tmp_path: Path) -> None:
    (tmp_path / RECENT_FILE).write_text(r'["/a\udcff.png", "/b.png"]')
    assert load_preferences(AppState(), tmp_path).recent == ("/a?.png", "/b.png")


def test_a_place_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="file") as error:
        store_preferences(AppState(), tmp_path / "file" / "folder")
    assert "\n" not in str(error.value)


def test_a_window_that_filled_the_screen_does_so_again_and_knows_where_it_was(tmp_path: Path) -> None:
    state = AppState()
    for action in (PlaceWindow((10, 20, 900, 700)), PlaceWindow(None)):
        state = reduce(state, action)
    store_preferences(state, tmp_path)
    again = load_preferences(AppState(), tmp_path).preferences
    assert (again.window, again.is_maximized) == ((10, 20, 900, 700), True)
    assert not reduce(state, PlaceWindow((0, 0, 800, 600))).preferences.is_maximized
