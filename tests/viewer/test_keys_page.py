"""The table of keys in docs/window.md, the help on F1 and the program agree."""

from __future__ import annotations

from itertools import takewhile
from pathlib import Path

import pytest
from imgui_bundle import imgui

from iibr_core.scenes.screen_size import ScreenSize
from tests.viewer.conftest import headless_with_scene
from viewer.model import messages
from viewer.model.action import do
from viewer.model.commands import COMMANDS
from viewer.ui.overlays.prompt_overlay import MOUSE

PAGE = Path(__file__).parents[2] / "docs" / "window.md"


def told_keys() -> set[str]:
    """What the first column of the table names."""
    lines = PAGE.read_text("utf-8").splitlines()
    start = lines.index("| in the window | |") + 2
    rows = takewhile(lambda line: line.startswith("|"), lines[start:])
    cells = [row.split(" | ")[0].removeprefix("| ") for row in rows]
    return {key.strip().replace("\\\\", "\\") for cell in cells for key in cell.split(", ")}


def test_the_table_names_every_key_and_gesture_and_no_other() -> None:
    keys = {chord.words for command in COMMANDS for chord in command.chords}
    assert told_keys() == keys | {gesture for gesture, _ in MOUSE}


def test_the_help_shows_them_all_and_what_they_do(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[str] = []
    build = imgui.text_wrapped

    def note(words: str) -> None:
        shown.append(words)
        build(words)

    with headless_with_scene(tmp_path) as viewer:
        viewer.do(do(messages.show_prompt, "help"))
        monkeypatch.setattr(imgui, "text_wrapped", note)
        viewer.screen(ScreenSize(1280, 800))
    last_frame = shown[len(shown) - 1 - shown[::-1].index(MOUSE[0][0]) :]
    told = dict(zip(last_frame[::2], last_frame[1::2], strict=True))
    assert {key for keys in told for key in keys.split(", ")} == told_keys()
    commands = {command.name.rstrip("…") for command in COMMANDS if command.chords}
    assert set(told.values()) == commands | {meaning for _, meaning in MOUSE}
