"""What the window shows, drawn without a window: words of the panel, both themes, and what lies over the picture."""

from dataclasses import replace

import pytest

from iibr_core.scenes.scene import Progress, Scene, Source
from iibr_core.types import GridShape
from viewer.model import opening, preferences
from viewer.model.app_state import AppState
from viewer.model.preferences import SECTIONS, with_sections
from viewer.model.saving import WRITING, JobProgress
from viewer.model.window import DrawReport
from viewer.ui.overlays.notice_corner import job_text
from viewer.ui.panel import is_final, progress_text, report_text, size_text

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
    before = preferences.toggle_section(before, section)
    opened = operated(before, **{f"{section.capitalize()}###section {section.capitalize()}": True})
    assert section in opened.preferences.open_sections
    operated(before)
    closed_items = len(built)
    operated(opened)
    assert len(built) > closed_items
    closed = operated(opened, **{f"{section.capitalize()}###section {section.capitalize()}": True})
    assert closed.preferences.open_sections == before.preferences.open_sections


def test_an_empty_window_asks_for_a_photo_only_while_none_is_on_its_way(operated, built):
    def asks(state):
        operated(state)
        return "Drop a photo here" in built.names("text_wrapped", window="welcome")

    empty = AppState(recent=("old.png",))
    asked = opening.open_source(empty, Source("holiday.jpg"))
    failed = opening.report_failure(asked, asked.generation, "no photo")
    assert [asks(state) for state in (empty, asked, failed)] == [True, False, True]
