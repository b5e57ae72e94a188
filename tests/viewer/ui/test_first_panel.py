"""What somebody sees who opens the program for the first time: few controls, and the rest where it is remembered."""

from dataclasses import replace

import pytest

from iibr_core.depth.choice import DepthOrigin
from iibr_core.scenes.scene import Progress
from iibr_core.scenes.screen_size import ScreenSize
from tests.viewer.ui.conftest import CONTROLS
from viewer.model import preferences, window
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.commands import BY_NAME
from viewer.model.preferences import Preferences, is_seen_open, with_sections
from viewer.ui.sections.depth_section import depth_source

WINDOW = ScreenSize(1280, 800)
MAX_CONTROLS = 17


@pytest.fixture
def first(viewer):
    """As at the first start, with a scene open."""
    viewer.state = replace(viewer.state, preferences=Preferences(), hides_panel=None)
    return viewer


@pytest.mark.parametrize("is_working", [False, True])
def test_there_are_few_controls_at_the_first_start(first, built, is_working):
    if is_working:
        first.state = replace(first.state, progress=Progress(4, 9, 0.3))
    first.screen(WINDOW)
    controls = built.names(*CONTROLS)
    assert any("section More" in words for words in controls)
    assert len(controls) <= MAX_CONTROLS, controls
    assert {"Undo", "Redo", "Mouse and keys"} <= {words.partition("##")[2] for words in controls}
    assert ("Cancel" in controls) is is_working


@pytest.mark.parametrize("font_scale", [1.0, 1.5])
def test_nothing_below_the_status_lines_moves_whatever_they_say(first, built, font_scale):
    first.state = replace(first.state, preferences=Preferences(font_scale=font_scale))
    long = Progress(doing="estimating depth with a model of an unusually long name from a folder, 40 %", left_s=7000.0)
    seen = set()
    for progress in (Progress(), Progress(doing="making views"), Progress(4, 9), Progress(9, 9, 3.0, share=1.0), long):
        first.state = replace(first.state, progress=progress)
        first.screen(WINDOW)
        seen |= {item.top for item in built if item.name == "Portrait"}
    for words in ("flat", "estimated by the model of_an_unusually_long_name_from_a_folder.onnx"):
        first.state = replace(first.state, scene=replace(first.scene, depth_origin=DepthOrigin("model", words)))
        first.screen(WINDOW)
        seen |= {item.top for item in built if item.name == "Portrait"}
    assert len(seen) == 1


@pytest.mark.parametrize(
    ("progress", "words"), [(Progress(0, 9, doing="finding disparity"), "being looked for"), (Progress(), "none")]
)
def test_views_without_depth_say_whether_it_is_looked_for(first, progress, words):
    scene = replace(first.scene, depth_source="none", depth_origin=None)
    assert depth_source(replace(first.state, progress=progress), scene) == words


def test_what_is_open_within_a_closed_section_opens_again_with_it():
    state = AppState(preferences=Preferences(open_sections=with_sections((), "depth")))
    closed = preferences.toggle_section(state, "more")
    assert not is_seen_open("depth", closed.preferences.open_sections)
    assert preferences.toggle_section(closed, "more") == state


def test_in_a_narrow_window_the_panel_folds_away_and_comes_back_when_asked_for(first, built):
    narrow, toggle = ScreenSize(700, 500), BY_NAME["Hide or show the panel"]
    for size, is_there in ((WINDOW, True), (narrow, False), (WINDOW, True), (narrow, False)):
        first.screen(size)
        assert bool(built.names("button")) is is_there
    first.do(toggle.action(first.state))
    first.screen(narrow)
    assert built.names("button")
    first.do(toggle.action(first.state))
    assert first.state.hides_panel is None, "it follows the window again"
    first.do(do(window.set_narrow, False))
    first.do(toggle.action(first.state))
    assert first.state.is_panel_hidden
    full = window.set_fullscreen(AppState(hides_panel=False), True)
    assert full.is_panel_hidden
    assert window.set_fullscreen(full, False).hides_panel is False, "as the user had it"
