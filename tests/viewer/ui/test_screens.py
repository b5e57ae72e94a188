"""What the window shows, drawn without a window: words of the panel, both themes, and what lies over the picture."""

from dataclasses import replace

import numpy as np
import pytest

from iibr_core.depth.choice import DepthOrigin
from iibr_core.depth.editing.edits import DepthEdits
from iibr_core.scenes.scene import Progress, Scene, Source
from iibr_core.types import GridShape
from tests.viewer.conftest import reduce
from viewer.model import depth, inspection, lens, messages, opening, preferences, saving, window
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.browsing import PathPrompt
from viewer.model.commands import PalettePrompt
from viewer.model.inspection import Hover
from viewer.model.layout import PANEL_WIDTH
from viewer.model.messages import Notice
from viewer.model.preferences import SECTIONS, with_sections
from viewer.model.remedies import BETTER_DEPTH
from viewer.model.saving import WRITING, JobProgress
from viewer.model.window import DrawReport
from viewer.ui.overlays.notice_corner import job_text
from viewer.ui.panel import is_final, progress_text, report_text, size_text
from viewer.ui.style import DARK, LIGHT

SIZE = 640, 1400
ENOUGH_PIXELS = 60
"""Least number of pixels that differ where something new is drawn: a short word."""
CONVERGED = DrawReport(samples=4, samples_converged=4, draw_ms=12.0)


@pytest.mark.parametrize(
    ("progress", "words"),
    [
        (Progress(), ""),
        (Progress(doing="reading a.png"), "reading a.png"),
        (Progress(23, 81, 0.2345), "23 of 81 views"),
        (Progress(23, 81, 12.3, left_s=31.2), "23 of 81 views, about 30 s left"),
        (Progress(81, 81, 31.0, share=1.0), "81 of 81 views, 31 s"),
        (Progress(81, 81, 100.0, share=1.0), "81 of 81 views, 2 min"),
        (Progress(0, 81, 31.0), "0 of 81 views"),
        (Progress(1, 1, 0.0, share=1.0), "1 of 1 view, 0.0 s"),
        (Progress(0, 81, 2.0, "finding disparity", 0.3, left_s=70.0), "finding disparity, about 70 s left"),
    ],
)
def test_progress_in_words(progress, words):
    assert progress_text(progress) == words
    assert progress.is_complete == (progress.share == 1.0)


def test_sizes_reports_and_jobs_in_words():
    assert report_text(CONVERGED, has_all_views=True) == "Drawn in 12 ms, final"
    assert report_text(CONVERGED, has_all_views=False) == "Drawn in 12 ms"
    assert report_text(DrawReport(1, 4, 12.0), has_all_views=True) == "Drawn in 12 ms, refining"
    scene = Scene(Source("a.png"), "a", 60, 40, GridShape(3, 9), (-2.0, 3.0), "a.pfm")
    assert size_text(scene) == "60 x 40 px, 3 x 9 views"
    drawing = JobProgress(1, "picture", "a.png", "drawing", 0.23)
    assert job_text(drawing) == "drawing, 23 %"
    assert job_text(replace(drawing, left_s=8.0)) == "drawing, 23 %, about 8 s left"
    assert job_text(replace(drawing, doing=WRITING, done=1.0)) == "writing the file"
    assert job_text(JobProgress(2, "export", "a.mp4")) == "waiting for its turn"


def test_a_picture_is_final_once_no_view_can_change_it():
    whole = AppState(generation=1, shown_generation=1, progress=Progress(9, 9, 1.0, share=1.0))
    assert is_final(whole)
    assert not is_final(replace(whole, generation=2)), "other views are asked for"
    assert not is_final(replace(whole, progress=Progress(8, 9, 1.0, share=0.9)))
    assert not is_final(replace(whole, free_progress=0.5)), "the free camera shows a draft"


def with_open(state, *sections):
    return replace(state, preferences=replace(state.preferences, open_sections=with_sections((), *sections)))


@pytest.mark.parametrize("section", SECTIONS)
def test_every_section_opens_and_closes_by_its_heading(viewer, operated, built, section):
    before = with_open(viewer.state, section)
    before = reduce(before, do(preferences.toggle_section, section))
    opened = operated(before, **{f"{section.capitalize()}###section {section.capitalize()}": True})
    assert section in opened.preferences.open_sections
    operated(before)
    closed_items = len(built)
    operated(opened)
    assert len(built) > closed_items
    closed = operated(opened, **{f"{section.capitalize()}###section {section.capitalize()}": True})
    assert closed.preferences.open_sections == before.preferences.open_sections


def test_the_panel_tells_progress_drawing_notes_and_poor_depth(viewer, operated, built):
    state = with_open(viewer.state, "depth", "scene")
    state = reduce(state, do(opening.set_progress, state.generation, Progress(4, 9, 0.3)))
    state = reduce(state, do(window.set_report, DrawReport(3, 9, 12.0)))
    poor = DepthOrigin("rough", "rough, guessed without a model", ("The photo's own depth was not used.",))
    scene = replace(state.scene, notes=("7.3 % of the map is unknown.",), depth_origin=poor)
    operated(replace(state, scene=scene))
    told = {"4 of 9 views", "Drawn in 12 ms, refining", "7.3 % of the map is unknown.", BETTER_DEPTH, *poor.failures}
    assert told <= set(built.said())


def test_clips_show_in_their_sliders_and_as_handles_of_the_histogram(viewer, operated, built):
    def handles(edits):
        operated(reduce(with_open(viewer.state, "depth"), do(depth.set_tone, edits, False)))
        at = {item.name: item for item in built if item.name.startswith(("handle", "##Far", "##Near"))}
        return at, [at[f"handle {name}"].left for name in ("far_clip", "near_clip")]

    _, (left, right) = handles(DepthEdits())
    sliders, places = handles(DepthEdits(far_clip=0.25, near_clip=0.625))
    assert [sliders[f"##{name} clip"].words for name in ("Far", "Near")] == ["0.25", "0.62"]
    assert places == pytest.approx([left + share * (right - left) for share in (0.25, 0.625)])
    assert right > left


def changed_after(viewer, *actions):
    """(H, W) bool: where the screen differs after the actions."""
    before = viewer.screen(SIZE).astype(int)
    viewer.do(*actions)
    return np.abs(viewer.screen(SIZE) - before).max(axis=2) > 24


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
def test_what_lies_over_the_picture_is_seen_where_it_belongs(viewer, action, rows):
    changed = changed_after(viewer, action)
    beside_panel = changed[:, : -int(PANEL_WIDTH)]
    assert beside_panel.sum() > ENOUGH_PIXELS
    assert not changed[:, 0].any(), "cut off at the window's border"
    found = np.flatnonzero(beside_panel.any(axis=1))
    assert rows[0] <= found.min() < found.max() < rows[1]


def test_light_and_dark(viewer):
    for theme, palette in (("dark", DARK), ("light", LIGHT)):
        viewer.do(do(preferences.set_theme, theme))
        screen = viewer.screen(SIZE) / 255
        np.testing.assert_allclose(screen[-2, -8], palette.panel[:3], atol=0.01)
        np.testing.assert_allclose(screen[2, 2], palette.background[:3], atol=0.01)
        text = np.abs(screen[:, -int(PANEL_WIDTH) :] - np.array(palette.text[:3])).max(axis=2) < 0.1
        assert text.sum() > 20 * ENOUGH_PIXELS


def test_an_empty_window_asks_for_a_photo_only_while_none_is_on_its_way(operated, built):
    def asks(state):
        operated(state)
        return "Drop a photo here" in built.names("text_wrapped", window="welcome")

    empty = AppState(recent=("old.png",))
    asked = reduce(empty, do(opening.open_source, Source("holiday.jpg")))
    failed = reduce(asked, do(opening.report_failure, asked.generation, "no photo"))
    assert [asks(state) for state in (empty, asked, failed)] == [True, False, True]
