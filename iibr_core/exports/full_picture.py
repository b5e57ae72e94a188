"""A picture of a photo at its own size or smaller; `full_drawing` draws it from views of the photo on disk."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import Optics
from iibr_core.color import bytes_from_encoded, primaries_matrix, srgb_from_linear
from iibr_core.exports.render_settings import MAX_PIXELS
from iibr_core.method.memory import require_memory
from iibr_core.method.plan import ScenePlan
from iibr_core.runtime.tiling import in_bands
from iibr_core.scenes.rect import WHOLE, Rect
from iibr_core.scenes.scene import LoadedPhoto, Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ColorSpace, FloatImage, InputError, image_size

OWN_SIZE_BYTES = 60
"""Bytes of a pixel of a picture at the photo's own size, while it is drawn."""


@dataclass(frozen=True, eq=False)
class FullPicture:
    """A picture to be drawn. size: of the result. part: the drawn part, as a share of the whole picture."""

    scene: Scene
    plan: ScenePlan
    loaded: LoadedPhoto
    optics: Optics
    size: ScreenSize
    part: Rect = WHOLE


def encode_light(light: FloatImage, is_linear: bool, target: ColorSpace, source: ColorSpace) -> NDArray[Any]:
    """Convert linear light (H, W, 3) to another colour space; return light, or bytes encoded by sRGB's curve."""
    encoded = np.empty(light.shape, np.float32 if is_linear else np.uint8)
    matrix = primaries_matrix(target, source)

    def band(first: int, last: int) -> None:
        rows = light[first:last]
        converted = rows if target == source else rows @ matrix.T
        encoded[first:last] = converted if is_linear else bytes_from_encoded(srgb_from_linear(converted))

    in_bands(band, image_size(light))
    return encoded


def is_full(scene: Scene, optics: Optics, size: ScreenSize) -> bool:
    """Return whether a picture of this size is drawn from the photo at its own size.

    It is if it is larger than the scene's views, fits into memory, and has neither a dolly nor gloss.
    """
    if optics.dolly != 0 or optics.gloss is not None or scene.plan is None or scene.own_size is None:
        return False
    if min(math.prod(size), math.prod(scene.own_size)) <= math.prod(scene.size):
        return False
    try:
        require_full(scene)
    except InputError:
        return False
    return True


def require_full(scene: Scene) -> None:
    """Raise InputError if a picture at the photo's own size does not fit into memory."""
    if scene.own_size is not None:
        pixels = min(math.prod(scene.own_size), MAX_PIXELS)
        require_memory(
            pixels * OWN_SIZE_BYTES, f"a picture at the photo's own size, {pixels / 1e6:.1f} million pixels,"
        )
