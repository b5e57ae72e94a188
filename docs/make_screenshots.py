"""Makes the pictures of docs/window.md from the demo photo, without a display: python docs/make_screenshots.py [FOLDER]

screenshot.png: the window, refocused. inspection.png: disparity, EPIs and values.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from iibr_core.runtime.resources import resource_folder
from iibr_core.scenes.scene import Source
from iibr_core.types import ViewOffset
from viewer.app.headless import HeadlessViewer
from viewer.model.actions import DismissNotice, SetHover
from viewer.model.state.app_state import Hover
from viewer.model.state.inspection import SetInspection, SetOverlay
from viewer.model.state.optics_actions import ApertureShape, MoveEye, SetAperture, SetFocus, SetOptics
from viewer.model.state.preferences import Section, with_sections

SIZE = 1200, 760
MOST_BYTES = 700_000
TANK = 0.57, 0.42
"""Place of the motorcycle's tank, as shares of the picture."""


def main() -> None:
    """Write the pictures beside this script, or into the folder named."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    with HeadlessViewer() as viewer:
        viewer.open(Source(str(resource_folder("assets") / "motorcycle" / "motorcycle.png")))
        write(folder / "screenshot.png", whole_window(viewer))
        write(folder / "inspection.png", inspection(viewer))


def whole_window(viewer: HeadlessViewer) -> NDArray[np.uint8]:
    """Return the window: seen from the left, focused on the tank, wide open with seven blades."""
    open_sections(viewer)
    viewer.do(MoveEye(ViewOffset(0.5, -1.5)))
    pointed = hover_at(viewer, *TANK)
    assert pointed.disparity is not None
    viewer.do(
        SetFocus(pointed.disparity), SetAperture(6.0), SetOptics("aperture_shape", ApertureShape("polygon", blades=7))
    )
    viewer.do(DismissNotice(None), SetHover(pointed))
    return viewer.screen(SIZE)


def inspection(viewer: HeadlessViewer) -> NDArray[np.uint8]:
    """Disparity over the picture, EPIs through the pointer, values under it."""
    open_sections(viewer, "inspect")
    viewer.do(
        SetAperture(0.0),
        SetInspection("shows_epis", True),
        SetInspection("shows_values", True),
        SetOverlay("disparity"),
    )
    viewer.do(SetHover(hover_at(viewer, *TANK)))
    return viewer.screen(SIZE)


def open_sections(viewer: HeadlessViewer, *sections: Section) -> None:
    """Open these sections of the panel, with those that they lie in, and no others."""
    opened = with_sections((), *sections)
    viewer.state = replace(viewer.state, preferences=replace(viewer.state.preferences, open_sections=opened))


def hover_at(viewer: HeadlessViewer, x_share: float, y_share: float) -> Hover:
    """The pointer at a place of the picture."""
    scene = viewer.state.scene
    assert scene is not None
    x, y = x_share * scene.width, y_share * scene.height
    return Hover(x, y, viewer.pick(x, y))


def write(path: Path, pixels: NDArray[np.uint8]) -> None:
    """Write a PNG that is small enough for a repository: compressed harder than the program does."""
    spec = oiio.ImageSpec(pixels.shape[1], pixels.shape[0], 3, "uint8")
    spec.attribute("png:compressionLevel", 9)
    buffer = oiio.ImageBuf(spec)
    buffer.set_pixels(oiio.ROI(), np.ascontiguousarray(pixels))
    if not buffer.write(str(path)):
        raise SystemExit(f"{path}: {buffer.geterror()}")
    if path.stat().st_size > MOST_BYTES:
        raise SystemExit(f"{path}: {path.stat().st_size} bytes, more than {MOST_BYTES}")
    print(f"{path}: {path.stat().st_size // 1000} kB")


if __name__ == "__main__":
    main()
