"""The picture of a real lens beside a data set's views: lens.png with lens.json in the scene's folder.

lens.json says {"focus_disparity": px per view step, "radius_views": of the round aperture, in view steps}.
"""

from __future__ import annotations

import json
import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from iibr_core.formats.files import is_file, read_text
from iibr_core.formats.images.decode import read_size
from iibr_core.formats.images.photo import read_photo
from iibr_core.formats.light_fields.multi_view_scene import MultiView
from iibr_core.types import FloatImage, InputError

PICTURE, ABOUT = "lens.png", "lens.json"


@dataclass(frozen=True, eq=False)
class LensPicture:
    """picture: (H, W, 3) sRGB-encoded, taken at the centre view's place. focus_disparity: px per view step, sharp.

    radius_views: of the aperture, in view steps.
    """

    picture: FloatImage
    focus_disparity: float
    radius_views: float


def read_lens_picture(scene: MultiView, max_pixels: int) -> LensPicture | None:
    """That of a scene, made smaller as its views are; None where there is none. Raises InputError for damaged ones."""
    beside = scene.views[scene.centre].path
    folder = beside.parent.parent if beside.parent.name == "views" else beside.parent
    if not is_file(folder / ABOUT):
        return None
    focus_disparity, radius_views = _numbers(folder / ABOUT)
    if (size := read_size(folder / PICTURE)) != (wanted := read_size(beside)):
        raise InputError(f"{folder / PICTURE}: is {size}, but {beside.name} is {wanted}; make them equal")
    picture = np.clip(read_photo(folder / PICTURE, max_pixels).pixels, 0, 1)
    return LensPicture(picture, focus_disparity * picture.shape[1] / size.width, radius_views)


def _numbers(path: Path) -> tuple[float, float]:
    try:
        told = json.loads(read_text(path))
        focus, radius = float(told["focus_disparity"]), float(told["radius_views"])
    except (ValueError, OverflowError, KeyError, TypeError, RecursionError) as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{path}: cannot be read ({error}); give focus_disparity and radius_views") from error
    if not (math.isfinite(focus) and math.isfinite(radius) and 0 < radius <= 100):
        raise InputError(f"{path}: focus_disparity {focus}, radius_views {radius}: give finite ones, the radius > 0")
    return focus, radius
