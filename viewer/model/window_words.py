"""What the core says, in the words of the window: nobody there types options, a button does what they would.

The core speaks to the command line, where `--max-pixels` is what one needs to hear.
"""

from __future__ import annotations

import re

from iibr_core.depth.choice import BETTER_WAYS
from viewer.model.state.notices import Notice

DEPTH_COMMANDS = ("Depth models…", "Open a depth map…")
"""What helps where depth is guessed or missing, by the names of commands."""

_WORDS = (
    (re.escape(BETTER_WAYS), "With a depth map or a depth model it is true to the scene."),
    (r"--invert-depth turns it if that is wrong", "Invert, under Depth, turns it if that is wrong"),
    (r"turn them with --invert-depth", "turn them with Invert, under Depth"),
    (r"add --stretch if it shows the whole photo", "open it as a depth map if it shows the whole photo"),
    (r" \(--max-pixels \d+\)", ""),
    (r"`iibr models get ([\w.-]+)`|iibr models get ([\w.-]+)", r"the button below"),
    (r"give --force to replace it, or choose", "choose"),
    (r"--([a-z]+)-([a-z]+)", r"\1 \2"),
    (r"--([a-z]+)", r"\1"),
)
_ASKS_FOR_DEPTH = re.compile(r"--disparity FILE|--depth-model|iibr models get|--depth model|" + re.escape(BETTER_WAYS))


def notice_in_window(text: str, is_error: bool = False) -> Notice:
    """A notice that says this, without options, and offers the commands that do what it advises."""
    commands = DEPTH_COMMANDS if _ASKS_FOR_DEPTH.search(text) else ()
    return Notice(words_in_window(text), is_error, commands=commands)


def words_in_window(text: str) -> str:
    """The text without options of the command line."""
    for pattern, words in _WORDS:
        text = re.sub(pattern, words, text)
    return " ".join(text.split())
