"""What somebody sees who opens the program for the first time: few controls, and the rest where it is remembered."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from typing import Any

import pytest
from imgui_bundle import imgui

from iibr_core.scenes.scene import Progress
from iibr_core.scenes.screen_size import ScreenSize
from tests.viewer.conftest import headless_with_scene, reduce
from tests.viewer.ui.watched_widgets import watch_widgets
from viewer.display.offscreen import OffscreenScene
from viewer.model import preferences, window
from viewer.model.action import do
from viewer.model.commands import BY_NAME
from viewer.model.state.app_state import AppState
from viewer.model.state.preferences import SECTIONS, Preferences, Section, is_seen_open, with_sections
from viewer.ui.sections.depth_section import depth_source

WINDOW = ScreenSize(1280, 800)
MAX_CONTROLS = 17
CONTROLS = (
    "button", "small_button", "invisible_button", "checkbox", "radio_button", "slider_float", "slider_int",
    "begin_combo", "selectable", "tree_node_ex", "input_int", "input_float", "input_text_with_hint", "color_edit3",
)  # fmt: skip


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[OffscreenScene]:
    with headless_with_scene(tmp_path_factory.mktemp("first")) as viewer:
        yield viewer


@pytest.fixture
def first(viewer: OffscreenScene) -> OffscreenScene:
    """As at the first start, with a scene open."""
    viewer.state = replace(viewer.state, preferences=Preferences(), hides_panel=None)
    return viewer


@pytest.fixture
def controls(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The words of each control of the panel that was built last."""
    found: list[str] = []

    def record(kind: str, arguments: tuple[Any, ...]) -> None:
        if imgui.internal.get_current_window_read().name == "panel":
            found.append(arguments[0])

    watch_widgets(monkeypatch, CONTROLS, found, record)
    return found


@pytest.mark.parametrize("is_working", [False, True])
def test_there_are_few_controls_at_the_first_start(
    first: OffscreenScene, controls: list[str], is_working: bool
) -> None:
    if is_working:
        first.state = replace(first.state, progress=Progress(4, 9, 0.3))
    first.screen(WINDOW)
    assert any("section More" in words for words in controls)
    assert len(controls) <= MAX_CONTROLS, controls
    assert {"Undo", "Redo", "Mouse and keys"} <= {words.partition("##")[2] for words in controls}
    assert ("Cancel" in controls) is is_working


@pytest.mark.parametrize("font_scale", [1.0, 1.5])
def test_nothing_below_the_status_line_moves_whatever_it_says(
    first: OffscreenScene, monkeypatch: pytest.MonkeyPatch, font_scale: float
) -> None:
    places: list[float] = []

    def record(kind: str, arguments: tuple[Any, ...]) -> None:
        if arguments[0] == "Portrait":
            places.append(imgui.get_item_rect_min().y)

    watch_widgets(monkeypatch, ("button",), places, record)
    first.state = replace(first.state, preferences=Preferences(font_scale=font_scale))
    long = Progress(doing="estimating depth with a model of an unusually long name from a folder, 40 %", left_s=7000.0)
    seen = set[float]()
    for progress in (Progress(), Progress(doing="making views"), Progress(4, 9), Progress(9, 9, 3.0, share=1.0), long):
        first.state = replace(first.state, progress=progress)
        first.screen(WINDOW)
        seen.add(places[-1])
    assert len(seen) == 1


@pytest.mark.parametrize(
    ("progress", "words"), [(Progress(0, 9, doing="finding disparity"), "being looked for"), (Progress(), "none")]
)
def test_views_without_depth_say_whether_it_is_looked_for(
    first: OffscreenScene, progress: Progress, words: str
) -> None:
    assert first.scene is not None
    scene = replace(first.scene, depth_source="none", depth_origin=None)
    assert depth_source(replace(first.state, progress=progress), scene) == words


def test_more_brings_headings_and_advanced_two_more(first: OffscreenScene, controls: list[str]) -> None:
    first.do(do(preferences.toggle_section, "more"))
    first.screen(WINDOW)
    headings = [words.partition("###section ")[2] for words in controls if "###section " in words]
    assert headings == ["More", "View", "Focus", "Aperture", "Light", "Gloss", "Depth", "Stereo display", "Advanced"]
    first.do(do(preferences.toggle_section, "advanced"))
    first.screen(WINDOW)
    assert {"Inspect", "Scene"} <= {words.partition("###section ")[2] for words in controls}


@pytest.mark.parametrize("section", SECTIONS)
def test_a_section_that_is_opened_is_visible_with_its_parent(section: Section) -> None:
    opened = reduce(AppState(), do(preferences.toggle_section, section))
    assert is_seen_open(section, opened.preferences.open_sections)
    closed = reduce(opened, do(preferences.toggle_section, section))
    assert section not in closed.preferences.open_sections


def test_what_is_open_within_a_closed_section_opens_again_with_it() -> None:
    state = AppState(preferences=Preferences(open_sections=with_sections((), "depth")))
    closed = reduce(state, do(preferences.toggle_section, "more"))
    assert not is_seen_open("depth", closed.preferences.open_sections)
    assert reduce(closed, do(preferences.toggle_section, "more")) == state


def test_in_a_narrow_window_the_panel_folds_away_and_comes_back_when_asked_for(
    first: OffscreenScene, controls: list[str]
) -> None:
    narrow, toggle = ScreenSize(700, 500), BY_NAME["Hide or show the panel"]
    for size, is_there in ((WINDOW, True), (narrow, False), (WINDOW, True), (narrow, False)):
        controls.clear()
        first.screen(size)
        assert bool(controls) is is_there
    first.do(toggle.action(first.state))
    first.screen(narrow)
    assert controls
    first.do(toggle.action(first.state))
    assert first.state.hides_panel is None, "it follows the window again"
    first.do(do(window.set_narrow, False))
    first.do(toggle.action(first.state))
    assert first.state.is_panel_hidden
