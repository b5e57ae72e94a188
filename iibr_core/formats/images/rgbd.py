"""Pictures with their depth map beside or below them in one file, for light-field displays and depth tools."""

import re
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import COPY, stamp_of
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.picture_source import PicturePart, PictureSource, small_picture
from iibr_core.types import ImageSize

TAG = re.compile(rf"(?:[_.-]|^)rgbd{COPY}$", re.IGNORECASE)
"""Ending of a file's name that states a picture and its map, in any order."""
MIN_ASPECT = 1.9
"""Smallest ratio of the sides of a picture that holds two without stating it in its name."""
COMPARED = ImageSize(192, 192)
"""Largest size of the picture whose halves are compared."""
GREY_TOLERANCE, MAX_COLORED_SHARE = 16 / 255, 0.01
"""Largest difference of a map's channels, as a share of white, and the largest share of its pixels that exceed it.

Lossy compression shifts channels.
"""
MIN_COLORED_SHARE = 0.15
"""Smallest share of coloured pixels in a photo whose map lies beside it."""


def rgbd_parts(path: Path) -> tuple[PictureSource, PictureSource] | None:
    """Return the picture and its map, which are halves of one file; None for other files.

    One half must be grey and the other one coloured. The file's name must state the pair, or its sides differ by a
    factor of about 2.
    """
    return _parts(path, stamp_of(path))


@lru_cache(maxsize=64)
def _parts(path: Path, stamp: tuple[int, ...]) -> tuple[PictureSource, PictureSource] | None:
    size, is_named = open_picture(path).upright_size, TAG.search(path.stem) is not None
    if min(size) < 2 or not (is_named or max(size) >= MIN_ASPECT * min(size)):
        return None
    pixels = small_picture(path, COMPARED)
    # A pair with such a name may have any shape: the longer side is tried first.
    axes = (0, 1) if size.height > size.width else (1, 0)
    for axis in axes if is_named else axes[:1]:
        grey = None if pixels is None else _grey_half(pixels, axis, 0.0 if is_named else MIN_COLORED_SHARE)
        if grey is not None:
            return _halves(path, size, axis, grey)
    return None


def _grey_half(pixels: NDArray[np.uint8], axis: int, min_colored: float) -> int | None:
    """Return which half along an axis is grey, 0 or 1; None unless `min_colored` of the other half is coloured."""
    is_colored = np.ptp(pixels.astype(np.int16), axis=2) > GREY_TOLERANCE * 255
    first, second = (float(part.mean()) for part in np.split(is_colored, (pixels.shape[axis] // 2,), axis=axis))
    if second <= MAX_COLORED_SHARE and first >= min_colored:
        return 1
    return 0 if first <= MAX_COLORED_SHARE and second >= min_colored else None


def _halves(path: Path, size: ImageSize, axis: int, grey: int) -> tuple[PictureSource, PictureSource]:
    part = ImageSize(size.height // 2, size.width) if axis == 0 else ImageSize(size.height, size.width // 2)
    starts = ((0, 0), (size.height - part.height, size.width - part.width))
    halves = [PictureSource(path, part=PicturePart(start, part)) for start in starts]
    return halves[1 - grey], halves[grey]
