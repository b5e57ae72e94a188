"""Pictures with their depth map beside or below them in one file, as light-field displays and depth tools take them."""

from __future__ import annotations

import re
from functools import lru_cache
from pathlib import Path
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import status_of
from iibr_core.formats.images.oiio_reader import read_orientation
from iibr_core.formats.images.picture_source import PicturePart, PictureSource, source_size
from iibr_core.formats.images.small_picture import small_picture
from iibr_core.types import ImageSize

TAG = re.compile(r"(?:[_.-]|^)rgbd$", re.IGNORECASE)
"""At the end of a file's name: it holds both, in whatever order."""
LEAST_ASPECT = 1.9
"""Pictures whose sides differ by less hold no two that are looked for without such a name."""
LOOKED_AT_PX = 192
GREY_TOLERANCE, MOST_COLORED = 12, 0.01
"""A map's channels differ by no more than this of 255, but for this share of its pixels."""
LEAST_COLORED = 0.15
"""At least this share of a photo's pixels is coloured, where its map lies beside it."""

Half = Literal["first", "second"]


def rgbd_parts(path: Path) -> tuple[PictureSource, PictureSource] | None:
    """The picture and its map, which are halves of one file; None where a file is no such pair.

    A file is one if its name says so or its sides differ by a factor of 2 or so, one half is grey and the other is not.
    Raises InputError where it cannot be read.
    """
    status = status_of(path)
    return None if status is None else _parts(path, status.st_mtime_ns, status.st_size)


@lru_cache(maxsize=64)
def _parts(path: Path, modified_ns: int, size_bytes: int) -> tuple[PictureSource, PictureSource] | None:
    size = source_size(PictureSource(path))
    size = ImageSize(size.width, size.height) if read_orientation(path) >= 5 else size
    is_named = TAG.search(path.stem) is not None
    if min(size) < 2 or not (is_named or max(size) >= LEAST_ASPECT * min(size)):
        return None
    pixels = small_picture(path, LOOKED_AT_PX)
    # A named one may have any shape: the longer side is tried first.
    axes = (0, 1) if size.height > size.width else (1, 0)
    for axis in axes if is_named else axes[:1]:
        grey = None if pixels is None else _grey_half(pixels, axis, 0.0 if is_named else LEAST_COLORED)
        if grey is not None:
            return _halves(path, size, axis, grey)
    return None


def _grey_half(pixels: NDArray[np.uint8], axis: int, least_colored: float) -> Half | None:
    """The half along an axis that is a map; None unless one is grey and of the other at least this share coloured."""
    middle = pixels.shape[axis] // 2
    apart = np.ptp(pixels.astype(np.int16), axis=2) > GREY_TOLERANCE
    first, second = (float(part.mean()) for part in np.split(apart, (middle,), axis=axis))
    if second <= MOST_COLORED and first >= least_colored:
        return "second"
    return "first" if first <= MOST_COLORED and second >= least_colored else None


def _halves(path: Path, size: ImageSize, axis: int, grey: Half) -> tuple[PictureSource, PictureSource]:
    part = ImageSize(size.height // 2, size.width) if axis == 0 else ImageSize(size.height, size.width // 2)
    starts = ((0, 0), (size.height - part.height, size.width - part.width))
    picture, depth = (PictureSource(path, part=PicturePart(start, part)) for start in starts)
    return (depth, picture) if grey == "first" else (picture, depth)
