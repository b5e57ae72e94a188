"""What the keys ask for."""

import functools
from dataclasses import replace

import pytest
from imgui_bundle import imgui

from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import reduce
from viewer.app.keys import Keys, actions_from_keys, read_keys
from viewer.model import inspection, lens, messages, saving, window
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.commands import PalettePrompt

SCENE = Scene(Source("photo.png", max_pixels=7), "photo", 600, 400, GridShape(9, 9), (-2.0, 3.0), "photo.pfm")
STATE = AppState(source=SCENE.source, scene=SCENE)


@pytest.mark.parametrize(
    ("opens", "closes"),
    [
        ((), None),
        ((do(messages.show_prompt, "help"), do(inspection.compare, "photo")), do(messages.show_prompt, None)),
        ((do(inspection.compare, "photo"),), do(inspection.compare, None)),
        ((do(lens.show_tilt_handles, True),), do(lens.show_tilt_handles, False)),
        ((do(inspection.set_overlay, "disparity"),), do(inspection.set_overlay, None)),
        ((do(window.set_fullscreen, True), do(inspection.set_overlay, "disparity")), do(inspection.set_overlay, None)),
        ((do(window.set_fullscreen, True),), do(window.set_fullscreen, False)),
        ((do(inspection.show_views, True), do(inspection.compare, "photo")), do(inspection.show_views, False)),
    ],
)
def test_escape_closes_what_lies_over_the_picture(opens, closes):
    done = actions_from_keys(Keys(is_escape=True), functools.reduce(reduce, opens, STATE))
    assert done == ([] if closes is None else [closes])


def test_what_is_typed_too_early_is_no_command():
    """The palette comes up, and has the keyboard a frame later."""
    keys = Keys(arrows=ViewOffset(1, 0), commands=("Take a snapshot", "Save the picture…"))
    assert actions_from_keys(keys, replace(STATE, prompt=PalettePrompt())) == [do(saving.ask_to_save)]
    *_, move = actions_from_keys(keys, replace(STATE, prompt="help"))
    assert move == do(lens.move_eye, ViewOffset(0.5, 0))


def test_a_key_counts_with_the_modifiers_it_was_pressed_with(monkeypatch):
    """In a long frame Ctrl is up again before ImGui handles the key."""
    monkeypatch.setattr(imgui, "is_key_pressed", lambda key, repeats=True: key == imgui.Key.p)
    context = imgui.create_context()
    try:
        assert read_keys({}).commands == ("Compare with the photo",)
        assert read_keys({"p": (True, False)}).commands == ("All commands",)
    finally:
        imgui.destroy_context(context)
