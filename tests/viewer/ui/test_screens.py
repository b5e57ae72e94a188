"""Every panel, drawn without a window: something is there, in both themes, whole at any size of text."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from imgui_bundle import imgui

from iibr_core.scenes.scene import Progress, Source
from tests.viewer.conftest import headless_with_scene, reduce
from tests.viewer.ui.watched_widgets import watch_widgets
from viewer.display.offscreen import OffscreenScene
from viewer.model import inspection, lens, messages, opening, preferences, saving, viewpoint, window
from viewer.model.action import Action, do
from viewer.model.layout import PANEL_WIDTH
from viewer.model.state.app_state import AppState, DrawReport, Hover
from viewer.model.state.notices import Notice
from viewer.model.state.preferences import SECTIONS, Section, with_sections
from viewer.model.state.prompts import WRITING, JobProgress, PalettePrompt, PathPrompt
from viewer.ui.overlays.notice_corner import job_text
from viewer.ui.style import DARK, LIGHT

SIZE = 640, 1400
ENOUGH_PIXELS = 60
"""Least number of pixels that differ where something new is drawn: a short word."""


@pytest.fixture(scope="module")
def opened(tmp_path_factory: pytest.TempPathFactory) -> Iterator[OffscreenScene]:
    with headless_with_scene(tmp_path_factory.mktemp("screens")) as viewer:
        yield viewer


def changed_after(viewer: OffscreenScene, *actions: Action) -> np.ndarray:
    """(H, W) bool: where the screen differs after the actions."""
    before = viewer.screen(SIZE).astype(int)
    viewer.do(*actions)
    return np.abs(viewer.screen(SIZE) - before).max(axis=2) > 24


def in_panel(screen: np.ndarray, scale: float = 1.0) -> np.ndarray:
    return screen[:, -int(PANEL_WIDTH * scale) :]


@pytest.mark.parametrize("section", SECTIONS)
def test_every_section_opens_and_closes(viewer: OffscreenScene, section: Section) -> None:
    before = viewer.state.preferences
    sections = with_sections(before.open_sections, "inspect")  # the sections that hold it are open
    viewer.state = replace(viewer.state, preferences=replace(before, open_sections=sections))
    first = viewer.screen(SIZE)
    changed = changed_after(viewer, do(preferences.toggle_section, section))
    assert in_panel(changed).sum() > 10 * ENOUGH_PIXELS
    assert not changed[:, : -int(PANEL_WIDTH)].any()
    viewer.do(do(preferences.toggle_section, section))
    np.testing.assert_array_equal(viewer.screen(SIZE), first)


JOBS = JobProgress(1, "picture", "large.png", "drawing", 0.4), JobProgress(2, "export", "a.mp4")
AT_TOP, AT_BOTTOM, IN_PICTURE = (60, 480), (1240, 1390), (590, 850)
"""Rows of the screen: prompts open below the top, notices and jobs stand in the corner, all else by the photo."""


@pytest.mark.parametrize(
    ("action", "rows"),
    [
        (do(messages.show_prompt, PalettePrompt("mo")), AT_TOP),
        (do(saving.ask_to_save), AT_TOP),
        (do(messages.show_prompt, PathPrompt("photo")), AT_TOP),
        (do(messages.notify, Notice("damaged.png: cut off", is_error=True)), AT_BOTTOM),
        (do(saving.set_jobs, JOBS), AT_BOTTOM),
        (do(lens.show_tilt_handles, True), IN_PICTURE),
        (do(inspection.set_hover, Hover(48.0, 32.0, 1.5)), IN_PICTURE),
        (do(window.set_report, DrawReport(3, 9, 12.0, is_draft=True)), IN_PICTURE),
    ],
    ids=lambda value: type(value).__name__,
)
def test_what_lies_over_the_picture_is_seen_where_it_belongs(
    viewer: OffscreenScene, action: Action, rows: tuple[int, int]
) -> None:
    changed = changed_after(viewer, action)
    beside_panel = changed[:, : -int(PANEL_WIDTH)]
    assert beside_panel.sum() > ENOUGH_PIXELS
    assert not changed[:, 0].any(), "cut off at the window's border"
    found = np.flatnonzero(beside_panel.any(axis=1))
    assert rows[0] <= found.min() < found.max() < rows[1]


@pytest.fixture
def said(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """Sentences that the panel shows."""
    found: list[str] = []
    watch_widgets(monkeypatch, ("text_wrapped",), found, lambda kind, arguments: found.append(arguments[0]))
    return found


@pytest.mark.parametrize(
    ("action", "words"),
    [
        (do(viewpoint.set_loop, "eight"), None),
        (do(lens.set_aperture, 2.0), None),
        (do(opening.set_progress, 1, Progress(4, 9, 0.3)), "4 of 9 views"),
        (do(window.set_report, DrawReport(3, 9, 12.0)), "Drawn in 12 ms, refining"),
    ],
    ids=lambda value: type(value).__name__,
)
def test_the_panel_tells(viewer: OffscreenScene, said: list[str], action: Action, words: str | None) -> None:
    viewer.do(do(preferences.toggle_section, "scene"))
    assert in_panel(changed_after(viewer, action)).sum() > ENOUGH_PIXELS
    assert words is None or words in said


def test_light_and_dark(viewer: OffscreenScene) -> None:
    for theme, palette in (("dark", DARK), ("light", LIGHT)):
        viewer.do(do(preferences.set_theme, theme))  # type: ignore[arg-type]
        screen = viewer.screen(SIZE) / 255
        np.testing.assert_allclose(screen[-2, -8], palette.panel[:3], atol=0.01)
        np.testing.assert_allclose(screen[2, 2], palette.background[:3], atol=0.01)
        text = np.abs(in_panel(screen) - np.array(palette.text[:3])).max(axis=2) < 0.1
        assert text.sum() > 20 * ENOUGH_PIXELS


def test_what_is_under_way_in_words() -> None:
    drawing = JobProgress(1, "picture", "a.png", "drawing", 0.23)
    assert job_text(drawing) == "drawing, 23 %"
    assert job_text(replace(drawing, left_s=8.0)) == "drawing, 23 %, about 8 s left"
    assert job_text(replace(drawing, doing=WRITING, done=1.0)) == "writing the file"
    assert job_text(JobProgress(2, "export", "a.mp4")) == "waiting for its turn"


def test_the_scene_section_tells_what_reading_a_photo_changed(viewer: OffscreenScene, said: list[str]) -> None:
    preferences = replace(viewer.state.preferences, open_sections=with_sections((), "scene"))
    viewer.state = replace(viewer.state, preferences=preferences)
    before = viewer.screen(SIZE).astype(int)
    assert viewer.state.scene is not None
    viewer.state = replace(viewer.state, scene=replace(viewer.state.scene, notes=("7.3 % of the map is unknown.",)))
    changed = np.abs(viewer.screen(SIZE) - before).max(axis=2) > 24
    assert in_panel(changed).sum() > ENOUGH_PIXELS
    assert not changed[:, : -int(PANEL_WIDTH)].any()
    assert "7.3 % of the map is unknown." in said


def test_an_empty_window_asks_for_a_photo_only_while_none_is_on_its_way(
    viewer: OffscreenScene, monkeypatch: pytest.MonkeyPatch
) -> None:
    words: list[str] = []
    monkeypatch.setattr(imgui, "text_wrapped", words.append)
    viewer.state = AppState(recent=("old.png",))
    viewer.screen(SIZE)
    assert any(text.startswith("Drop a photo") for text in words)
    words.clear()
    viewer.state = reduce(viewer.state, do(opening.open_source, Source("holiday.jpg")))
    viewer.screen(SIZE)
    assert not words
    words.clear()
    viewer.state = reduce(viewer.state, do(opening.report_failure, viewer.state.generation, "no photo"))
    viewer.screen(SIZE)
    assert any(text.startswith("Drop a photo") for text in words)
