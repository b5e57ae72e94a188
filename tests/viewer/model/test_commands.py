"""The commands: each name and chord once, each with an action that the state accepts."""

from dataclasses import replace
from operator import attrgetter

import pytest
from imgui_bundle import imgui

from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape
from tests.viewer.conftest import reduce
from tests.viewer.model.test_opening import plan_of, scene_of, state_with
from viewer.model import saving
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.commands import BY_NAME, CAMERA_STEP, COMMANDS, FONT_STEP, Chord, commands_matching
from viewer.model.demo_photo import demo_photo
from viewer.model.inspection import Hover
from viewer.model.layout import Zoom
from viewer.model.presets import PRESETS
from viewer.model.saving import SavePrompt
from viewer.model.tasks import ChooseTask
from viewer.model.viewpoint import FreeCamera


def test_names_and_chords_are_unique_and_known_to_imgui():
    chords = [chord for command in COMMANDS for chord in command.chords]
    assert len(BY_NAME) == len(COMMANDS)
    assert len(set(chords)) == len(chords)
    assert all(hasattr(imgui.Key, chord.key) for chord in chords)


@pytest.mark.parametrize("command", COMMANDS, ids=lambda command: command.name)
@pytest.mark.parametrize("state", [AppState(), state_with(scene_of())], ids=["empty", "open"])
def test_every_command_can_be_given_at_any_time(command, state):
    assert isinstance(reduce(state, command.action(state)), AppState)


OPEN = replace(state_with(scene_of(plan=plan_of(GridShape(9, 9)))), hover=Hover(14.5, 9.5, 1.0))


@pytest.mark.parametrize(
    ("name", "part", "value"),
    [
        ("Step forward", "free_camera", FreeCamera(forward=CAMERA_STEP)),
        ("Step back", "free_camera", FreeCamera(forward=-CAMERA_STEP)),
        ("Look up", "free_camera", FreeCamera(down=-CAMERA_STEP)),
        ("Look down", "free_camera", FreeCamera(down=CAMERA_STEP)),
        ("Look left", "free_camera", FreeCamera(right=-CAMERA_STEP)),
        ("Look right", "free_camera", FreeCamera(right=CAMERA_STEP)),
        ("Larger text", "preferences.font_scale", FONT_STEP),
        ("Smaller text", "preferences.font_scale", 1 / FONT_STEP),
        ("Invert depth", "depth.edits.is_inverted", True),
        ("Preset: macro", "optics.focus_disparity", 3.0),
        ("Motion: figure of eight", "motion.kind", "eight"),
        ("Depth brush: smooth", "brush.tool", "smooth"),
        ("Select a subject", "brush.tool", "select"),
        ("Overlay: inpainting", "inspection.overlay", "inpainted"),
        ("Compare with the photo", "inspection.comparison", "photo"),
        ("Before and after", "shows_before", True),
        ("Light or dark", "preferences.theme", "light"),
        ("Units: a photographer's or a light field's", "preferences.units", "light field"),
        ("Stereo display: cross-eyed", "preferences.stereo_mode", "cross-eyed"),
        ("Zoom: the photo's own pixels, 1:1", "zoom", Zoom(1.0, (0.25, 0.25))),
    ],
)
def test_commands_do_what_their_names_say(name, part, value):
    assert attrgetter(part)(reduce(OPEN, BY_NAME[name].action(OPEN))) == value


def test_chords_in_words_and_what_commands_bring_up():
    assert Chord("z", ctrl=True, shift=True).words == "Ctrl+Shift+Z"
    assert [c.chords[0].words for c in COMMANDS if "text" in c.name.lower()] == ["Ctrl++", "Ctrl+−", "Ctrl+0"]
    state = state_with(scene_of())
    asked = reduce(state, BY_NAME["Save the picture…"].action(state))
    assert asked.prompt == SavePrompt("photo-iibr.png", (60, 40))
    helped = reduce(state, BY_NAME["Mouse and keys"].action(state))
    assert (helped.prompt, reduce(helped, BY_NAME["Mouse and keys"].action(helped)).prompt) == ("help", None)
    assert reduce(state, BY_NAME["Open a photo…"].action(state)).tasks == (ChooseTask("photo"),)


def test_the_palette_finds_by_parts_of_words():
    assert [c.name for c in commands_matching("preset")] == [f"Preset: {name}" for name in PRESETS]
    assert [c.name for c in commands_matching("AGAIN larger")] == []
    assert [c.name for c in commands_matching("TEXT lar")] == ["Larger text"]
    assert commands_matching("") == COMMANDS


@pytest.mark.parametrize("path", ["/home/a/.cache/iibr/clipboard/pasted/photo.png", str(demo_photo())])
def test_nothing_is_proposed_to_be_put_into_a_folder_of_the_program(path):
    """A cache that is emptied, the demo's in the installation."""
    state = state_with(replace(scene_of(source=Source(path)), name="photo"))
    saved, exported = (reduce(state, action).prompt for action in (do(saving.ask_to_save), do(saving.ask_to_export)))
    assert (saved.path, exported.path) == ("~/photo-iibr.png", "~/photo-web.html")
