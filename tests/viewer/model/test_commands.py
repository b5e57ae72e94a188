"""The commands: each name and chord once, what each does to an open photo and when given again, and the palette."""

from dataclasses import replace

from imgui_bundle import imgui

from iibr_core.depth.choice import DepthChoice
from tests.golden_text import assert_same_text
from tests.viewer.model.picture_stories import EMPTY, OPEN
from tests.viewer.model.scene_stories import PANEL, PHOTOS, TELEVISION
from tests.viewer.model.told import EXACT, changes
from viewer.model import folder
from viewer.model.app_state import AppState
from viewer.model.commands import BY_NAME, COMMANDS, action_for_path, commands_matching
from viewer.model.inspection import Hover
from viewer.model.lens import FIRST_GLOSS

STATE = folder.set_photos(replace(OPEN, hover=Hover(14.5, 9.5, 1.0), monitors=(PANEL, TELEVISION)), "/photos", PHOTOS)
STATE = replace(STATE, optics=replace(STATE.optics, aperture_diameter=1.0, gloss=FIRST_GLOSS))
CHOSEN = DepthChoice("model", file="a.pfm", file_scale=2.0, model="midas", refine=False)
CHOSEN = replace(STATE, source=replace(STATE.source, depth=CHOSEN, focus_disparity=1.0))
CHOICES = (
    ("photo", "/c.png"), ("folder", "/c"), ("mask", "/m.png"), ("map", "/c.pfm"), ("model", "/x.onnx"),
    ("model folder", "/x"),
)  # fmt: skip


def test_names_and_chords_are_unique_and_known_to_imgui():
    chords = [chord for command in COMMANDS for chord in command.chords]
    assert len(BY_NAME) == len(COMMANDS)
    assert len(set(chords)) == len(chords)
    assert all(hasattr(imgui.Key, chord.key) for chord in chords)


def given(state, action):
    """Return the state after an action, and what it changed."""
    after = action.apply(state)
    assert isinstance(after, AppState)
    return after, [f"    {line}" for line in changes(state, after)]


def test_each_command_does_what_its_name_says_and_again(regenerate_golden):
    lines = []
    for command in COMMANDS:
        words = ", ".join(chord.words for chord in command.chords)
        once, changed = given(STATE, command.action(STATE))
        lines += [f"{command.name} [{words}]{' repeats' * command.repeats}", *changed]
        lines += ["  again", *given(once, command.action(once))[1], "  with nothing open"]
        lines += given(EMPTY, command.action(EMPTY))[1]
    for what, path in CHOICES:
        for state in (STATE, CHOSEN, EMPTY):
            lines += [f"{what} {path}", *given(state, action_for_path(what, path, state))[1]]
    assert_same_text(lines, "viewer/stories", "commands", regenerate_golden, *EXACT)


def test_the_palette_finds_by_parts_of_words(regenerate_golden):
    recent = (replace(BY_NAME["Quit"], name="Open depth.png"),)
    found = {text: commands_matching(text, recent) for text in ("PRESET", "again larger", "TEXT lar", "de", "o dep")}
    lines = [f"{text}: {', '.join(command.name for command in commands)}" for text, commands in found.items()]
    assert_same_text(lines, "viewer/stories", "palette", regenerate_golden, *EXACT)
    assert commands_matching("") == COMMANDS
