"""Remedies of errors in the words of the window."""

from __future__ import annotations

from iibr_core.remedies import Remedy, with_remedy

DEPTH_COMMANDS = ("Depth models…", "Open a depth map…")
"""Names of commands that give better depth."""
BETTER_DEPTH = "A depth map or a depth model is more accurate."
WORDS = {
    Remedy.REPLACE: "choose another name",
    Remedy.PLACE: "choose another place",
    Remedy.SMALLER: "open a smaller copy of the photo",
    Remedy.DEPTH: "get it, or open a depth map",
    Remedy.DOWNLOAD: "try again later, or choose a model file",
    Remedy.VIEW_ORDER: "name them by row and column, and rectify views of cameras that were turned",
    **dict.fromkeys((Remedy.INVERT, Remedy.INVERT_OR_METRIC), "Invert in the panel turns it"),
    Remedy.STRETCH: "or open it as a depth map if it shows the whole photo",
}


def words_of(message: Exception | str) -> str:
    """Return an error or a note, with its remedy."""
    return with_remedy(message, WORDS)
