"""The scenes that were path-traced through a thin lens, see tests/data/thin_lens/README.md."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from iibr_core.evaluation.lens_picture import LensPicture, read_lens_picture

from iibr_core.evaluation.scenes import read_scene
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.types import (
    Disparity,
    FloatImage,
    GridShape,
    Photo,
)

FOLDER = Path(__file__).parents[1] / "data" / "thin_lens"
NAMES = ("shelf", "fence")
GRID = GridShape(5, 5)
MOST_PIXELS = 10**6


@dataclass(frozen=True, eq=False)
class LensScene:
    """photo, disparity: of the centre view. views: (H, W, 3) by (v, u). lens: what the refocused field has to match."""

    scene: MultiView
    photo: Photo
    disparity: Disparity
    views: dict[tuple[int, int], FloatImage]
    lens: LensPicture


def lens_scene(name: str) -> LensScene:
    """One of NAMES."""
    scene = read_scene(FOLDER / name)
    assert scene is not None
    lens = read_lens_picture(scene, MOST_PIXELS)
    assert lens is not None
    photo = read_photo(scene.views[scene.centre].path)
    values = np.load(scene.disparity[scene.centre].path)
    views = {(int(view.offset.t), int(view.offset.s)): read_photo(view.path).pixels for view in scene.views}
    return LensScene(scene, photo, Disparity(values, "exact"), views, lens)
