"""Pictures for the left and the right eye in one file: side by side, above each other, crossed, anaglyph, spatial."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import Optics
from iibr_core.exports.anaglyph import anaglyph
from iibr_core.exports.framing import draw_framed, side_pictures
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.images.picture_kinds import AS_USUAL, BEST_QUALITY, PictureFormat
from iibr_core.formats.images.side_by_side import FULL_TAG, HALF_OVER_TAG, HALF_TAG, OVER_TAG, TAG
from iibr_core.formats.images.spatial_photo import write_spatial_photo
from iibr_core.formats.quilts import tagged
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import SRGB, ColorSpace

Eyes = tuple[NDArray[Any], NDArray[Any]]


class _Arrangement(NamedTuple):
    """Arrangement of two pictures in a file. squeeze: divisors of their width and height. tag: end of its name."""

    join: Callable[[Eyes], NDArray[Any]]
    tag: str = ""
    squeeze: tuple[int, int] = (1, 1)


ARRANGEMENTS = {
    "sbs": _Arrangement(np.hstack, FULL_TAG),
    "half-sbs": _Arrangement(np.hstack, HALF_TAG, squeeze=(2, 1)),
    "over-under": _Arrangement(np.vstack, OVER_TAG),
    "half-over-under": _Arrangement(np.vstack, HALF_OVER_TAG, squeeze=(1, 2)),
    "cross-eyed": _Arrangement(lambda eyes: np.hstack(eyes[::-1])),
    "anaglyph": _Arrangement(lambda eyes: anaglyph(*eyes)),
}
TAGS = {(False, False): FULL_TAG, (False, True): HALF_TAG, (True, False): OVER_TAG, (True, True): HALF_OVER_TAG}
"""Tags by whether the pictures lie one over the other, and whether they are squeezed."""


def stereo_path(path: Path, scene: Scene, options: ExportOptions, variant: str) -> Path:
    """Return the path with the tag of its arrangement, unless the name contains an equivalent tag."""
    tag, match = ARRANGEMENTS[variant].tag, TAG.search(path.stem)
    known = match and TAGS[bool(match[3]), bool(match[1] or match[2])]
    return path if known == tag else tagged(path, tag)


def optics_of_eyes(scene: Scene, optics: Optics, options: ExportOptions) -> list[Optics]:
    """Return the optics of the left and the right picture."""
    return [eye.optics for eye in side_pictures(scene, RenderSettings(optics, options.size), 2, options.eyes)]


def draw_eyes(
    source: ExportSource, options: ExportOptions, squeeze: tuple[int, int] = (1, 1), color_space: ColorSpace = SRGB
) -> Eyes:
    """Return the left and the right picture, (H, W, 3) uint8, their width and height divided by `squeeze`."""
    width, height = options.size
    size = ScreenSize(max(width // squeeze[0], 1), max(height // squeeze[1], 1))
    settings = RenderSettings(source.optics, size, color_space=color_space)
    eyes = side_pictures(source.scene, settings, 2, options.eyes)
    left, right = source.watched((draw_framed(source, eye, width / height) for eye in eyes), 2, "drawing")
    return left, right


def write_stereo(path: Path, source: ExportSource, options: ExportOptions, variant: str) -> None:
    """Write both pictures in one of the ARRANGEMENTS.

    Anaglyphs are written in sRGB, for which their matrices hold, and at the best quality: coarse colour mixes the eyes.
    """
    arrangement, is_anaglyph = ARRANGEMENTS[variant], variant == "anaglyph"
    space = SRGB if is_anaglyph else source.color_space
    pixels = arrangement.join(draw_eyes(source, options, arrangement.squeeze, space))
    source.write_picture(path, pixels, PictureFormat(quality=BEST_QUALITY) if is_anaglyph else AS_USUAL, space)


def write_spatial(path: Path, source: ExportSource, options: ExportOptions) -> None:
    """Write a spatial photo for headsets."""
    left, right = draw_eyes(source, options)
    scale = left.shape[0] / source.scene.height
    write_spatial_photo(path, left, right, scale * (source.focal_px or source.scene.width), source.metadata)
