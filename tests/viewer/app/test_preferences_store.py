"""Preferences and recent files on disk: round trip, damage, and places where nothing can be written."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from iibr_core.types import InputError
from viewer.app.preferences_store import PREFERENCES_FILE, RECENT_FILE, load_preferences, store_preferences
from viewer.model.actions import PlaceWindow, SetFontScale, SetTheme, ToggleSection
from viewer.model.lens.limits import FONT_SCALE_LIMITS
from viewer.model.reducers.root import reduce
from viewer.model.state.app_state import AppState, Preferences


def test_what_is_kept_comes_back(tmp_path: Path) -> None:
    state = AppState(recent=("/photos/ä.png", "b.png"))
    for action in (SetTheme("light"), SetFontScale(1.5), ToggleSection("scene"), PlaceWindow((10, 20, 900, 700))):
        state = reduce(state, action)
    folder = tmp_path / "not" / "there" / "yet"
    store_preferences(state, folder)
    again = load_preferences(AppState(), folder)
    assert again.preferences == state.preferences
    assert again.preferences.open_sections == ("view", "focus", "aperture", "light", "scene")
    assert again.recent == ("/photos/ä.png", str(Path("b.png").absolute()))
    assert sorted(path.name for path in folder.iterdir()) == [PREFERENCES_FILE, RECENT_FILE]


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
    ("field", "value", "read"),
    [
        ("theme", "purple", "dark"),
        ("theme", ["light"], "dark"),
        ("font_scale", 1e9, FONT_SCALE_LIMITS[1]),
        ("font_scale", float("nan"), 1.0),
        ("font_scale", "2", 1.0),
        ("font_scale", -3, 1.0),
        ("open_sections", ["scene", "kitchen", 7], ("scene",)),
        ("open_sections", 3, Preferences().open_sections),
        ("window", [0, 0, 800, 600], (0, 0, 800, 600)),
        ("window", [0, 0, 8, 6], None),
        ("window", [0, 0, 10**9, 600], None),
        ("window", [0.5, 0, 800, 600], None),
        ("window", "here", None),
    ],
)
def test_a_senseless_value_does_not_lose_the_others(tmp_path: Path, field: str, value: object, read: object) -> None:
    kept = {"theme": "light", "font_scale": 1.5, "open_sections": [], "window": None, field: value}
    (tmp_path / PREFERENCES_FILE).write_text(json.dumps(kept))
    state = load_preferences(AppState(), tmp_path)
    assert getattr(state.preferences, field) == read
    assert state.notices == ()
    if field != "theme":
        assert state.preferences.theme == "light"


def test_a_place_that_cannot_be_written_is_one_line(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match="file") as error:
        store_preferences(AppState(), tmp_path / "file" / "folder")
    assert "\n" not in str(error.value)
