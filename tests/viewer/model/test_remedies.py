"""The core names no options; the command line and the window word its remedies themselves."""

import pickle
import re
from pathlib import Path

import pytest

import iibr_core
from docs.words import texts_of
from iibr_core.method.memory import require_memory
from iibr_core.remedies import FixableError, Remedy, remedy_of
from iibr_core.types import InputError
from viewer.cli import messages as command_line
from viewer.model import remedies as window
from viewer.model.commands import BY_NAME


def test_no_text_of_the_core_names_an_option_or_a_command():
    texts = [text for path in Path(iibr_core.__file__).parent.rglob("*.py") for _, text in texts_of(path)]
    assert len(texts) > 300
    assert not [text for text in texts if re.search(r"(^| )--[a-z]|`iibr ", text)]


@pytest.mark.parametrize("remedy", Remedy)
def test_each_interface_words_each_remedy(remedy):
    error = FixableError("a.png: is bad", remedy)
    assert command_line.words_of(error).startswith("a.png: is bad; ")
    assert command_line.words_of(error) != window.words_of(error)
    assert window.words_of(error).startswith("a.png: is bad; ")
    assert "--" not in window.words_of(error)
    assert command_line.words_of(InputError("bad")) == window.words_of(InputError("bad")) == "bad"
    assert remedy_of(pickle.loads(pickle.dumps(error))) is remedy, "workers are other processes"


def test_what_does_not_fit_can_be_made_smaller():
    with pytest.raises(FixableError, match=r"17 x 17 views of a\.jpg takes") as error:
        require_memory(2**60, "17 x 17 views of a.jpg")
    assert error.value.remedy is Remedy.SMALLER


def test_buttons_for_better_depth_are_commands():
    assert set(window.DEPTH_COMMANDS) <= BY_NAME.keys()
