"""The words of the panel; its widgets are tried out in test_window.py."""

from __future__ import annotations

import pytest

from iibr_core.generation.plan import ScenePlan
from iibr_core.types import GridShape, Quality
from viewer.model.state.app_state import Progress, Scene, Source
from viewer.ui.panel import progress_text, size_text


@pytest.mark.parametrize(
    ("progress", "words"),
    [
        (Progress(), ""),
        (Progress(doing="reading a.png"), "reading a.png"),
        (Progress(23, 81, 0.2345), "23 of 81 views, 0.2 s"),
        (Progress(23, 81, 12.3), "23 of 81 views, 12.3 s, 31 s left"),
        (Progress(1, 81, 5.0), "1 of 81 views, 5.0 s, 7 min left"),
        (Progress(81, 81, 31.0), "81 of 81 views, 31.0 s"),
        (Progress(0, 81, 31.0), "0 of 81 views, 31.0 s"),
        (Progress(1, 1, 0.0), "1 of 1 view, 0.0 s"),
    ],
)
def test_progress_in_words(progress: Progress, words: str) -> None:
    assert progress_text(progress) == words


@pytest.mark.parametrize(
    ("quality", "is_made", "words"),
    [
        ("fast", True, "60 × 40 px, 3 × 9 views, fast"),
        ("balanced", True, "60 × 40 px, 3 × 9 views"),
        ("exact", True, "60 × 40 px, 3 × 9 views, exact"),
        ("exact", False, "60 × 40 px, 3 × 9 views"),
    ],
)
def test_quality_is_told_where_views_are_made_and_not_plain(quality: Quality, is_made: bool, words: str) -> None:
    grid = GridShape(3, 9)
    plan = ScenePlan(grid, 1.0, 0.0, (-2.0, 3.0), 0.1, True, 0, 0, ()) if is_made else None
    scene = Scene(Source("a.png", quality=quality), "a", 60, 40, grid, (-2.0, 3.0), "a.pfm", plan=plan)
    assert size_text(scene) == words
