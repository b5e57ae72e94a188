"""Makes the pictures of docs/edges.md from the demo photo, without a display: python docs/make_edges.py [FOLDER]

edges_NAME.png, three rows of a place at twice its size in an outermost view: a plain warp of the given map, the light
field without refined edges, the light field as the program makes it.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import OpenImageIO as oiio

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.search import open_with_depth
from iibr_core.evaluation.warp import reference_warp
from iibr_core.method.photo_views import PhotoViews
from iibr_core.runtime.resources import resource_folder
from iibr_core.types import FloatImage, ViewOffset

OUTERMOST, STEPS = ViewOffset(0.0, 1.0), [ViewOffset(t, s) for t in (-1.0, 0.0, 1.0) for s in (-1.0, 0.0, 1.0)]
PLACES = {"fork": (430, 190, 140, 110), "handlebar": (340, 80, 160, 100)}
"""Left, top, width and height of the close-ups in the view, in pixels."""


def main() -> None:
    """Write all of them."""
    folder = Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent
    demo = resource_folder("assets") / "motorcycle" / "motorcycle.png"
    given = open_with_depth(demo, DepthChoice(refine=0.0))
    refined = open_with_depth(demo)
    photo = given.photo.pixels
    views = [
        np.asarray(reference_warp(photo, given.disparity.values, OUTERMOST).colors),
        *(_view(photo, found.disparity.values) for found in (given, refined)),
    ]
    for name, (left, top, width, height) in PLACES.items():
        place = np.s_[top : top + height, left : left + width]
        rows = np.concatenate([view[place].repeat(2, axis=0).repeat(2, axis=1) for view in views])
        _write(folder / f"edges_{name}.png", rows)


def _view(photo: FloatImage, disparity: FloatImage) -> FloatImage:
    """The outermost view of a light field, as `generate` makes it."""
    return PhotoViews(photo, disparity, STEPS).view(OUTERMOST).colors


def _write(path: Path, colors: FloatImage) -> None:
    height, width, channels = colors.shape
    picture = oiio.ImageBuf(oiio.ImageSpec(width, height, channels, "uint8"))
    picture.set_pixels(oiio.ROI(), np.clip(colors, 0, 1).astype(np.float32))
    if not picture.write(str(path)):
        raise SystemExit(f"{path}: {picture.geterror()}")


if __name__ == "__main__":
    main()
