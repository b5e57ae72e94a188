"""The README's table of keys, the help on F1 and the program agree."""

from __future__ import annotations

from pathlib import Path

from viewer.model.commands import COMMANDS
from viewer.ui.overlays.prompts import MOUSE

README = Path(__file__).parents[2] / "README.md"


def told_keys() -> set[str]:
    """What the first column of the table names."""
    lines = README.read_text("utf-8").splitlines()
    start = lines.index("| in the window | |") + 2
    rows = [line for line in lines[start : start + 60] if line.startswith("|")]
    ends = next((i for i, line in enumerate(lines[start:]) if not line.startswith("|")), len(rows))
    cells = [row.split(" | ")[0].removeprefix("| ") for row in lines[start : start + ends]]
    return {key.strip().replace("\\\\", "\\") for cell in cells for key in cell.split(", ")}


def test_the_table_names_every_key_and_gesture_and_no_other() -> None:
    keys = {chord.words for command in COMMANDS for chord in command.chords}
    assert told_keys() == keys | {gesture for gesture, _ in MOUSE}


def test_the_help_shows_every_command_that_has_a_key() -> None:
    """It is made of the same table: what it shows of each is its first chord and its name, both distinct."""
    shown = [(command.chords[0].words, command.name) for command in COMMANDS if command.chords]
    assert len({key for key, _ in shown}) == len({name for _, name in shown}) == len(shown) > 20
