"""The window speaks no command line, whatever the core says; what it advises is a button."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

import iibr_core
from iibr_core.depth.choice import BETTER_WAYS
from iibr_core.method.memory import require_memory
from iibr_core.types import InputError
from viewer.model.commands import BY_NAME
from viewer.model.messages import notify
from viewer.model.state.app_state import AppState
from viewer.model.state.notices import Notice
from viewer.model.window_words import DEPTH_COMMANDS, notice_in_window, words_in_window


def test_nothing_that_the_core_says_reads_as_an_option_in_the_window() -> None:
    """Every line of its source that names one, as it stands: what is filled in has no options."""
    sources = Path(iibr_core.__file__).parent.rglob("*.py")
    lines = {line.strip() for path in sources for line in path.read_text().splitlines() if re.search(r" --[a-z]", line)}
    assert len(lines) > 20
    assert not [line for line in lines if "--" in words_in_window(line).replace("---", "")]


def test_a_photo_without_depth_offers_what_helps() -> None:
    notice = notice_in_window(f"Depth: rough, guessed without a model. {BETTER_WAYS}")
    assert notice.commands == DEPTH_COMMANDS
    assert "--" not in notice.text
    assert notice.text.endswith(".")
    assert set(DEPTH_COMMANDS) <= BY_NAME.keys()
    assert notice_in_window("scene.pfm was resampled.") == Notice("scene.pfm was resampled.")


def test_what_does_not_fit_says_what_would_without_options() -> None:
    with pytest.raises(InputError) as refused:
        require_memory(2**60, "17 x 17 views of a.jpg")
    assert "--" in str(refused.value)
    said = notify(AppState(), Notice(str(refused.value), is_error=True)).notices[0]
    assert "--" not in said.text
    assert said.is_error
