"""`iibr demo`: the window on the photo that comes along, or pictures of it."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from iibr_core.formats.outputs import check_output_folder, make_folder
from iibr_core.scenes.inputs import inputs_of
from iibr_core.scenes.scene import Source
from iibr_core.types import InputError
from viewer.cli.shared_options import SCREEN_SIZE
from viewer.cli.terminal import show_progress
from viewer.model.demo_photo import demo_photo

if TYPE_CHECKING:
    from iibr_core.scenes.scene import Source

DEMO_FOLDER = Path("out")


def demo() -> None:
    """Open the viewer on the demo photo; without a display, render it to out/demo.png and out/demo-views.png.

    Example: iibr demo
    """
    from viewer.app.main_loop import App, initial_state
    from viewer.app.preferences_store import user_folder

    source = Source(str(demo_photo()))
    try:
        window = App(initial_state(source), user_folder())
    except InputError as error:
        _demo_pictures(source, str(error))
        return
    try:
        window.run()
    finally:
        window.close()


def _demo_pictures(source: Source, why: str) -> None:
    """why: there is no window, for people."""
    from viewer.app.contact_sheet import contact_sheet
    from viewer.app.image_export import export_image
    from viewer.display.offscreen import OffscreenScene

    window, views = DEMO_FOLDER / "demo.png", DEMO_FOLDER / "demo-views.png"
    check_output_folder(DEMO_FOLDER, inputs_of(source), may_replace=True)
    make_folder(DEMO_FOLDER)
    print(f"{why}. Rendering without one.")
    with OffscreenScene() as viewer:
        with show_progress("reading"):
            viewer.open(source)
        export_image(window, viewer.screen(SCREEN_SIZE) if viewer.gl.backend != "osmesa" else viewer.picture())
        export_image(views, contact_sheet(viewer))
    print(f"{window}: the viewer's window")
    print(f"{views}: viewpoints above, focus from near to far below")
