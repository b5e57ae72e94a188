"""The words of the panel; its widgets are tried out in test_window.py."""

from __future__ import annotations

import pytest

from viewer.state import Progress
from viewer.ui.panel import progress_words


@pytest.mark.parametrize(
    ("progress", "words"),
    [
        (Progress(), ""),
        (Progress(doing="reading a.png"), "reading a.png"),
        (Progress(23, 81, 1.2345), "23 of 81 views, 1.2 s"),
        (Progress(1, 1, 0.0), "1 of 1 view, 0.0 s"),
    ],
)
def test_progress_in_words(progress: Progress, words: str) -> None:
    assert progress_words(progress) == words
