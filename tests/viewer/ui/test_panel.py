"""The words of the panel; its widgets are tried out in test_window.py."""

from __future__ import annotations

from dataclasses import replace

import pytest

from iibr_core.scenes.scene import Progress, Scene, Source
from iibr_core.types import GridShape
from viewer.model.state.app_state import AppState, DrawReport
from viewer.ui.panel import is_final, progress_text, report_text, size_text


@pytest.mark.parametrize(
    ("progress", "words"),
    [
        (Progress(), ""),
        (Progress(doing="reading a.png"), "reading a.png"),
        (Progress(23, 81, 0.2345), "23 of 81 views"),
        (Progress(23, 81, 12.3, left_s=31.2), "23 of 81 views, about 30 s left"),
        (Progress(1, 81, 5.0), "1 of 81 views"),
        (Progress(81, 81, 31.0, share=1.0), "81 of 81 views, 31 s"),
        (Progress(0, 81, 31.0), "0 of 81 views"),
        (Progress(1, 1, 0.0, share=1.0), "1 of 1 view, 0.0 s"),
        (Progress(0, 81, 2.0, "finding disparity", 0.3, left_s=70.0), "finding disparity, about 70 s left"),
    ],
)
def test_progress_in_words(progress: Progress, words: str) -> None:
    assert progress_text(progress) == words


def test_it_is_complete_once_every_view_is_there() -> None:
    assert [Progress(done, 9).is_complete for done in (0, 8, 9)] == [False, False, True]
    assert not Progress(0, 0).is_complete


def test_a_picture_is_final_only_with_all_views_as_they_stay() -> None:
    converged = DrawReport(samples=4, samples_converged=4, draw_ms=12.0)
    assert report_text(converged, has_all_views=True) == "Drawn in 12 ms, final"
    assert report_text(converged, has_all_views=False) == "Drawn in 12 ms"
    assert report_text(DrawReport(1, 4, 12.0), has_all_views=True) == "Drawn in 12 ms, refining"


def test_the_size_in_words() -> None:
    assert size_text(Scene(Source("a.png"), "a", 60, 40, GridShape(3, 9), (-2.0, 3.0), "a.pfm")) == (
        "60 x 40 px, 3 x 9 views"
    )


def test_a_picture_is_final_once_no_view_can_change_it() -> None:
    whole = AppState(generation=1, shown_generation=1, progress=Progress(9, 9, 1.0, share=1.0))
    assert is_final(whole)
    assert not is_final(replace(whole, generation=2)), "other views are asked for"
    assert not is_final(replace(whole, progress=Progress(8, 9, 1.0, share=0.9)))
    assert not is_final(replace(whole, free_progress=0.5)), "the free camera shows a draft"
