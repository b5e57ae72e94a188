"""What the window says: no words that only the code needs, and none that the field has better ones for."""

from __future__ import annotations

import re

import pytest

from benchmarks.texts import Text, texts_in, texts_of

ADVANCED = (
    "viewer/ui/sections/inspect.py",
    "viewer/ui/sections/scene_section.py",
    "viewer/ui/overlays/inspection_overlay.py",
)
"""What these show is seen by who opened that part of the panel."""

FOR_COMMAND_LINE = re.compile(r"iibr [a-z]|--(size|disparity|depth|max-pixels|memory|grid|quality|force|inpaint)\b")
TRANSLATED = "viewer/model/window_words.py"
"""It names options to replace them."""

SHARED = ("viewer/model/saved_settings.py", "viewer/model/gloss_file.py", "viewer/app/window.py")
"""Their errors are told on the command line, too."""

FORBIDDEN = re.compile(
    r"asking the transformer|\bholes?\b|stored view|kept state|best there is|to the middle|usual text|surroundings"
    r"|made up|\bworker\b|\brims?\b|\bcrumbs?\b|\bspecks?\b|is to end in|means nothing to",
    re.IGNORECASE,
)


@pytest.fixture(scope="module")
def texts() -> list[Text]:
    return texts_in()


def test_there_are_texts_of_every_kind(texts: list[Text]) -> None:
    words = {text.words for text in texts}
    assert len(texts) > 400
    assert {"Open a photo…", "Depth strength", "Recenter", "Reset text size", "Glossy surface", "Snapshot"} <= words
    assert {"Automatic", "Get true depth"} <= words


def test_none_has_words_that_only_the_code_needs(texts: list[Text]) -> None:
    assert not [text for text in texts if FORBIDDEN.search(text.words)]


def test_none_speaks_of_options_or_of_entropy_where_nobody_asked(texts: list[Text]) -> None:
    in_window = [text for text in texts if text.file not in (TRANSLATED, *SHARED)]
    assert not [text for text in in_window if FOR_COMMAND_LINE.search(text.words)]
    assert not [text for text in in_window if "entropy" in text.words.lower() and text.file not in ADVANCED]


def test_docstrings_names_and_types_are_no_texts() -> None:
    source = '''
"""A docstring of words."""
KIND: Literal["one kind of words"] = "plain"
LABEL = "Some words"
def f(n):
    """Another docstring of words."""
    return f"{n} views of {n}", "id##hidden words", "snake_case", "Word…"
'''
    assert [text.words for text in texts_of(source, "a.py")] == ["Some words", "{} views of {}", "Word…"]
