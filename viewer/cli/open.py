"""`iibr open`: photos in the running window, else in a new one. The file manager and the menu call it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iibr_core.scenes.scene import Source
from viewer.app.dropped_files import actions_from_drop
from viewer.cli.options import require_source
from viewer.cli.view import open_window
from viewer.model.handover import TAKEN, message_from_paths, window_address
from viewer.model.state.app_state import AppState

ANSWER_S = 3.0
"""Time for the running window to answer, in seconds."""


def open_photos(
    paths: Annotated[
        list[Path] | None,
        typer.Argument(metavar="PATHS", help="Photos; the first is opened.", show_default="the start page"),
    ] = None,
) -> None:
    """Open a photo in the window that is already open, else in a new one.

    Example: iibr open holiday.jpg
    """
    names = [str(path.absolute()) for path in paths or ()]
    for name in names:
        require_source(Source(name))
    if not hand_over(names):
        open_window(None, 1.0, *actions_from_drop(names, AppState()))


def hand_over(paths: list[str]) -> bool:
    """Let the running window open these paths; return whether it does."""
    from multiprocessing.connection import Client  # no other command needs it

    address = window_address()
    if address is None:
        return False
    try:
        with Client(address) as connection:
            connection.send_bytes(message_from_paths(paths))
            return connection.poll(ANSWER_S) and connection.recv_bytes(len(TAKEN)) == TAKEN
    except (OSError, EOFError):
        return False
