"""`iibr open`: photos in the running window, else in a new one. The file manager and the menu call it."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from iibr_core.scenes.scene import Source
from viewer.app.handover import hand_over
from viewer.cli.options import require_source
from viewer.cli.view import open_window
from viewer.model import opening
from viewer.model.action import do


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
        open_window(None, 1.0, do(opening.open_paths, names))
