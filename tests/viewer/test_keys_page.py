"""The table of keys in docs/window.md, the help on F1 and the program agree."""

from itertools import takewhile
from pathlib import Path

from imgui_bundle import imgui

from iibr_core.scenes.screen_size import ScreenSize
from tests.viewer.conftest import headless_with_scene
from viewer.model import messages
from viewer.model.action import do
from viewer.model.commands import COMMANDS
from viewer.ui.overlays.prompt_overlay import MOUSE

PAGE = Path(__file__).parents[2] / "docs" / "window.md"


def test_the_page_and_the_help_show_every_key_and_gesture(tmp_path, monkeypatch):
    lines = PAGE.read_text("utf-8").splitlines()
    rows = takewhile(lambda line: line.startswith("|"), lines[lines.index("| in the window | |") + 2 :])
    cells = ", ".join(row.split(" | ")[0].removeprefix("| ") for row in rows).replace("\\\\", "\\")
    keys = {chord.words for command in COMMANDS for chord in command.chords} | {gesture for gesture, _ in MOUSE}
    assert {cell.strip() for cell in cells.split(", ")} == keys

    shown = []
    build = imgui.text_wrapped

    def note(words):
        shown.append(words)
        build(words)

    with headless_with_scene(tmp_path) as viewer:
        viewer.do(do(messages.show_prompt, "help"))
        monkeypatch.setattr(imgui, "text_wrapped", note)
        viewer.screen(ScreenSize(1280, 800))
    last_frame = shown[len(shown) - 1 - shown[::-1].index(MOUSE[0][0]) :]
    assert {key for words in last_frame[::2] for key in words.split(", ")} == keys
    commands = {command.name.rstrip("…") for command in COMMANDS if command.chords}
    assert set(last_frame[1::2]) == commands | {meaning for _, meaning in MOUSE}
