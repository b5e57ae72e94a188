"""Two pictures, for the left and the right eye, in one: side by side or one over the other, as the file's name says."""

from __future__ import annotations

import re
from pathlib import Path

from iibr_core.formats.images.oiio_reader import read_orientation
from iibr_core.formats.images.picture_source import PicturePart, PictureSource, source_size
from iibr_core.formats.images.rgbd import rgbd_parts
from iibr_core.types import ImageSize, InputError

FULL_TAG, HALF_TAG, OVER_TAG = "_LRF_Full_SBS", "_LRF_Half_SBS", "_TB"
"""At the end of a file's name, for players: left first, side by side; top and bottom."""
TAG = re.compile(r"_(?:(half)_?)?(?:full_?)?(?:(h?)sbs|2x1|(tb|ou))$", re.IGNORECASE)
"""Ours, and those of Looking Glass, Leia and video players."""
RAW_ENDINGS = (".lfp", ".lfr", ".lfx", ".raw")


def side_by_side_pair(path: Path) -> tuple[PictureSource, PictureSource] | None:
    """The left eye's picture and the right one's, None where the file's name does not say that it holds two.

    Raises InputError where it cannot be read, or is too small for two.
    """
    match = TAG.search(path.stem)
    if match is None:
        return None
    is_half, is_over = bool(match[1] or match[2]), match[3] is not None
    size = source_size(PictureSource(path))
    size = ImageSize(size.width, size.height) if read_orientation(path) >= 5 else size
    eye = ImageSize(size.height // 2, size.width) if is_over else ImageSize(size.height, size.width // 2)
    if min(eye) < 1:
        raise InputError(f"{path}: of {size} pixels there are none for each eye; is its name right?")
    shown = ImageSize(eye.height, 2 * eye.width) if is_half else None
    starts = ((0, 0), (eye.height, 0) if is_over else (0, eye.width))
    left, right = (PictureSource(path, part=PicturePart(start, eye), shown_size=shown) for start in starts)
    return left, right


def own_picture(path: Path) -> PictureSource:
    """What a file shows as a photo: the left eye's picture where it holds two, the picture where it holds one and its
    map, else all of it.

    Raises InputError as `side_by_side_pair` does, and for raw files of light-field cameras.
    """
    require_developed(path)
    parts = side_by_side_pair(path) or rgbd_parts(path)
    return PictureSource(path) if parts is None else parts[0]


def require_developed(path: Path) -> None:
    """Raise InputError for raw files of light-field cameras: a mosaic of what lies under each microlens."""
    if path.suffix.lower() in RAW_ENDINGS:
        raise InputError(
            f"{path}: is a raw light field (Lytro), which must be decoded first: PlenoptiCam or the Light Field Toolbox"
            " make views of it, and their folder opens here"
        )
