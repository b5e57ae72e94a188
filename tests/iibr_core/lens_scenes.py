"""The scenes that were path-traced through a thin lens, see tests/data/thin_lens/README.md."""

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from iibr_core.evaluation.metrics import psnr
from iibr_core.evaluation.scenes import read_scene
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.types import Disparity, FloatImage, GridShape, Photo

FOLDER = Path(__file__).parents[1] / "data" / "thin_lens"
NAMES = ("shelf", "fence")
GRID = GridShape(5, 5)


@dataclass(frozen=True, eq=False)
class LensPicture:
    """picture: (H, W, 3), taken at the centre view's place. focus_disparity: sharp, px per view step.

    radius_views: that of the aperture, in view steps.
    """

    picture: FloatImage
    focus_disparity: float
    radius_views: float


@dataclass(frozen=True, eq=False)
class LensScene:
    """photo, disparity: those of the centre view. views: (H, W, 3) by (v, u). lens: the true refocused picture."""

    scene: MultiView
    photo: Photo
    disparity: Disparity
    views: dict[tuple[int, int], FloatImage]
    lens: LensPicture

    def lens_db(self, picture: FloatImage) -> float:
        """Return the PSNR of a refocused picture (H, W, 3) against the lens, where all views show something."""
        margin = math.ceil(abs(self.lens.focus_disparity) * (self.lens.radius_views + 0.5)) + 2
        inner = np.s_[margin:-margin, margin:-margin]
        return psnr(picture[inner], self.lens.picture[inner])


def lens_scene(name: str) -> LensScene:
    scene = read_scene(FOLDER / name)
    stated = json.loads((FOLDER / name / "lens.json").read_text())
    picture = np.clip(read_photo(FOLDER / name / "lens.png").pixels, 0, 1)
    photo = read_photo(scene.views[scene.centre].path)
    values = np.load(scene.disparity[scene.centre].path)
    views = {(int(view.offset.t), int(view.offset.s)): read_photo(view.path).pixels for view in scene.views}
    lens = LensPicture(picture, stated["focus_disparity"], stated["radius_views"])
    return LensScene(scene, photo, Disparity(values, "exact"), views, lens)
