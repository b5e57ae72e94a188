"""Make the pictures of docs/gallery from the demo photo, without a display: python docs/make_pictures.py OUT [NAMES]

NAMES are file names of pictures; without them all are made. Commands of docs/gallery.md are run as they stand there.
"""

from __future__ import annotations

import shlex
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from iibr_core.beyond.optics import ApertureShape
from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.search import open_with_depth
from iibr_core.evaluation.warp import reference_warp
from iibr_core.method.light_field import ViewMaker
from iibr_core.scenes.scene import Source
from iibr_core.types import FloatImage, ViewOffset
from viewer.display.offscreen import OffscreenScene
from viewer.model import inspection, lens, messages
from viewer.model.action import do
from viewer.model.inspection import Hover
from viewer.model.preferences import Section, with_sections

ROOT = Path(__file__).parents[1]
DEMO = ROOT / "assets" / "motorcycle" / "motorcycle.png"
WINDOW = 1200, 760
FORK, HANDLEBAR = np.s_[185:295, 430:590], np.s_[80:190, 340:500]
"""Rows and columns of the close-ups in the outermost view."""


def main() -> None:
    """Make the pictures named on the command line."""
    folder, names = Path(sys.argv[1]), sys.argv[2:]
    makers = {"screenshot.png": screenshot, "inspection.png": inspection_screen, "edges.png": edges}
    lines = (ROOT / "docs" / "gallery.md").read_text("utf-8").splitlines()
    commands = {Path(line).name: shlex.split(line) for line in lines if line.startswith("iibr ")}
    for name in names or [*commands, *makers]:
        if name in commands:
            words = [*commands[name][1:-1], str(folder.resolve() / name), "--force"]
            subprocess.run([sys.executable, "-P", "-m", "viewer", *words], cwd=ROOT, check=True)
        else:
            write(folder / name, makers[name]())
        print(f"{folder / name}: {(folder / name).stat().st_size // 1000} kB", flush=True)


def screenshot() -> FloatImage:
    """Return the window: seen from the left, focused on the tank, wide open with seven blades."""
    with OffscreenScene() as viewer:
        open_demo(viewer)
        viewer.do(do(lens.move_eye, ViewOffset(0.5, -1.5)))
        tank = pointer_on_tank(viewer)
        blades = ApertureShape("polygon", blades=7)
        viewer.do(do(lens.set_focus, tank.disparity), do(lens.set_aperture, 6.0), do(lens.set_aperture_shape, blades))
        viewer.do(do(messages.dismiss), do(inspection.set_hover, tank))
        return viewer.screen(WINDOW) / np.float32(255)


def inspection_screen() -> FloatImage:
    """Return the window with disparity over the picture, EPIs through the pointer and values under it."""
    with OffscreenScene() as viewer:
        open_demo(viewer, "inspect")
        viewer.do(do(lens.set_aperture, 0.0), do(inspection.show_epis, True), do(inspection.show_values, True))
        viewer.do(do(inspection.set_overlay, "disparity"), do(inspection.set_hover, pointer_on_tank(viewer)))
        return viewer.screen(WINDOW) / np.float32(255)


def open_demo(viewer: OffscreenScene, *sections: Section) -> None:
    """Open the demo photo with these sections of the panel open, and no others."""
    viewer.open(Source(str(DEMO)))
    preferences = replace(viewer.state.preferences, open_sections=with_sections((), *sections))
    viewer.state = replace(viewer.state, preferences=preferences)


def pointer_on_tank(viewer: OffscreenScene) -> Hover:
    """Return the pointer on the motorcycle's tank."""
    scene = viewer.state.scene
    assert scene is not None
    x, y = 0.57 * scene.width, 0.42 * scene.height
    return Hover(x, y, viewer.pick(x, y))


def edges() -> FloatImage:
    """Return two close-ups of an outermost view, side by side; from top to bottom: warp, unrefined map, refined map."""
    outermost, steps = ViewOffset(0.0, 1.0), [ViewOffset(t, s) for t in (-1.0, 0.0, 1.0) for s in (-1.0, 0.0, 1.0)]
    given, refined = open_with_depth(DEMO, DepthChoice(refine=False)), open_with_depth(DEMO)
    photo, maps = given.photo.pixels, (given.disparity.values, refined.disparity.values)
    views = [np.asarray(reference_warp(photo, maps[0], outermost).colors)]
    views += [ViewMaker(photo, disparity, steps).view(outermost).colors for disparity in maps]
    rows = [np.concatenate([view[FORK], view[HANDLEBAR]], axis=1) for view in views]
    return np.concatenate(rows).repeat(2, axis=0).repeat(2, axis=1)


def write(path: Path, colors: FloatImage) -> None:
    """Write a PNG, compressed as far as possible."""
    spec = oiio.ImageSpec(colors.shape[1], colors.shape[0], 3, "uint8")
    spec.attribute("png:compressionLevel", 9)
    picture = oiio.ImageBuf(spec)
    picture.set_pixels(oiio.ROI(), np.ascontiguousarray(np.clip(colors, 0, 1), np.float32))
    if not picture.write(str(path)):
        raise SystemExit(f"{path}: {picture.geterror()}")


if __name__ == "__main__":
    main()
