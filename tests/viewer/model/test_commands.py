"""The commands: each name and chord once, each with an action that the state accepts."""

from __future__ import annotations

from dataclasses import replace

import pytest
from imgui_bundle import imgui

from iibr_core.scenes.scene import Source
from tests.viewer.conftest import reduce
from tests.viewer.model.test_opening import scene_of, state_with
from viewer.model import saving
from viewer.model.action import do
from viewer.model.commands import BY_NAME, COMMANDS, Chord, Command, commands_matching, recent_commands
from viewer.model.demo_photo import demo_photo
from viewer.model.state.app_state import AppState
from viewer.model.state.lens import PRESETS
from viewer.model.state.prompts import ExportPrompt, SavePrompt
from viewer.model.state.tasks import ChooseTask


def test_names_and_chords_are_unique_and_known_to_imgui() -> None:
    chords = [chord for command in COMMANDS for chord in command.chords]
    assert len(BY_NAME) == len(COMMANDS)
    assert len(set(chords)) == len(chords)
    assert all(hasattr(imgui.Key, chord.key) for chord in chords)


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
@pytest.mark.parametrize("state", [AppState(), state_with(scene_of())], ids=["empty", "open"])
def test_every_command_can_be_given_at_any_time(command: Command, state: AppState) -> None:
    assert isinstance(reduce(state, command.action(state)), AppState)


def test_chords_in_words_and_what_commands_bring_up() -> None:
    assert Chord("z", ctrl=True, shift=True).words == "Ctrl+Shift+Z"
    assert [c.chords[0].words for c in COMMANDS if "text" in c.name.lower()] == ["Ctrl++", "Ctrl+−", "Ctrl+0"]
    state = state_with(scene_of())
    asked = reduce(state, BY_NAME["Save the picture…"].action(state))
    assert asked.prompt == SavePrompt("photo-iibr.png", (60, 40))
    helped = reduce(state, BY_NAME["Mouse and keys"].action(state))
    assert (helped.prompt, reduce(helped, BY_NAME["Mouse and keys"].action(helped)).prompt) == ("help", None)
    assert reduce(state, BY_NAME["Open a photo…"].action(state)).tasks == (ChooseTask("photo"),)


def test_the_palette_finds_by_parts_of_words() -> None:
    assert [c.name for c in commands_matching("preset")] == [f"Preset: {name}" for name in PRESETS]
    assert [c.name for c in commands_matching("AGAIN larger")] == []
    assert [c.name for c in commands_matching("TEXT lar")] == ["Larger text"]
    assert commands_matching("") == COMMANDS


def test_recent_files_come_first_in_the_list_but_for_the_open_one() -> None:
    state = replace(state_with(scene_of()), recent=("photo.png", "/a/one.jpg", "/b/two.jpg"))
    assert state.source is not None
    assert state.source.path == "photo.png"
    listed = commands_matching("", recent_commands(state))
    assert [command.name for command in listed[:2]] == ["Open one.jpg", "Open two.jpg"]
    assert listed[2:] == COMMANDS
    opened = reduce(state, listed[0].action(state)).source
    assert opened is not None
    assert opened.path == "/a/one.jpg"
    assert [command.name for command in commands_matching("two", recent_commands(state))] == ["Open two.jpg"]


@pytest.mark.parametrize("path", ["/home/a/.cache/iibr/clipboard/pasted/photo.png", str(demo_photo())])
def test_nothing_is_proposed_to_be_put_into_a_folder_of_the_program(path: str) -> None:
    """A cache that is emptied, the demo's in the installation."""
    state = state_with(replace(scene_of(source=Source(path)), name="photo"))
    saved, exported = (reduce(state, action).prompt for action in (do(saving.ask_to_save), do(saving.ask_to_export)))
    assert isinstance(saved, SavePrompt)
    assert isinstance(exported, ExportPrompt)
    assert (saved.path, exported.path) == ("~/photo-iibr.png", "~/photo-web.html")


def test_commands_with_a_word_that_begins_so_come_first() -> None:
    names = [command.name for command in commands_matching("entr")]
    assert names.index("Overlay: entropy") < names.index("Centre the head")
