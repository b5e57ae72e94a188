"""`iibr demo`: the window on the demo photo, or pictures of it where no window can be opened."""

from __future__ import annotations

import os
from itertools import chain, count
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from iibr_core.scenes.scene import Scene, Source
from iibr_core.types import CENTRE, InputError
from viewer.cli.messages import print_notes, show_progress
from viewer.cli.view import open_window
from viewer.model.demo_photo import demo_photo

if TYPE_CHECKING:
    from iibr_core.beyond.optics import Optics

FOLDER = "iibr-demo"
PLANES = 3
"""Number of focus planes that are drawn with an open aperture."""
IN_A_WINDOW = (
    "With a display, `iibr demo` opens a window: drag to move the viewpoint, click to refocus, open the aperture in the"
    " panel."
)


def demo() -> None:
    """Open the viewer on the demo photo; without a display, draw pictures of it into a new folder here.

    Example: iibr demo
    """
    source = Source(str(demo_photo()))
    try:
        open_window(source)
    except InputError as error:
        print_notes(str(error))
        draw_pictures(source, _new_folder())
        print(IN_A_WINDOW)


def draw_pictures(source: Source, folder: Path) -> None:
    """Draw a scene into a new folder: the middle, the corners of the grid, focus from far to near. Print the files."""
    from iibr_core.exports.render_settings import RenderSettings
    from iibr_core.formats.images.write import write_picture
    from iibr_core.formats.outputs import write_folder
    from iibr_core.scenes.screen_size import ScreenSize
    from viewer.display.offscreen import OffscreenScene

    with OffscreenScene() as viewer, show_progress("drawing"):
        scene = viewer.open(source)
        size = ScreenSize(scene.width, scene.height)
        with write_folder(folder) as unfinished:
            sheets = _sheets(scene, viewer.state.optics)
            for name, (_, rows) in sheets.items():
                drawn = [np.hstack([viewer.draw(RenderSettings(optics, size)) for optics in row]) for row in rows]
                write_picture(unfinished / name, np.vstack(drawn))
    for name, (content, _) in sheets.items():
        print(f"{folder.absolute() / name}: {content}")


def _sheets(scene: Scene, optics: Optics) -> dict[str, tuple[str, list[list[Optics]]]]:
    """Return the content of each file in words, and the optics of its pictures, row by row."""
    from dataclasses import replace

    from iibr_core.exports.stack import focal_stack

    sharp, grid = replace(optics, eye=CENTRE, aperture_diameter=0.0), scene.grid
    *planes, _ = focal_stack(scene, sharp, PLANES).values()
    sides = [(row, column) for row in (0, grid.rows - 1) for column in (0, grid.columns - 1)]
    corners = [replace(sharp, eye=grid.offset(*side)) for side in sides]
    opened = f"the focus moves from far to near, the aperture is {planes[0].aperture_diameter:g} view steps wide"
    return {
        "middle.png": ("the photo, seen from the middle", [[sharp]]),
        "corners.png": ("the scene, seen from the four corners of the grid of views", [corners[:2], corners[2:]]),
        "focus.png": (opened, [planes]),
    }


def _new_folder() -> Path:
    """Return the first of iibr-demo, iibr-demo-2 and so on that does not exist in the working folder."""
    names = chain((FOLDER,), (f"{FOLDER}-{number}" for number in count(2)))
    return next(Path(name) for name in names if not os.path.lexists(name))
