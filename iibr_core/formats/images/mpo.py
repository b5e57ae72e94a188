"""Multi-picture JPEGs (CIPA DC-007), as stereo cameras write them: the left eye's picture, then the right eye's."""

from __future__ import annotations

from pathlib import Path

from iibr_core.formats.files import open_binary
from iibr_core.formats.images.oiio_reader import Raster
from iibr_core.formats.images.pillow_reader import open_with_pillow, raster_of
from iibr_core.types import ImageSize, InputError

JPEG_START = b"\xff\xd8\xff"
MPO = ("JPEG",), "a multi-picture JPEG"  # by which Pillow opens both
ENTRIES_TAG = 0xB002
DISPARITY_TYPE = "Disparity"
"""In Pillow's words for a picture's type."""
OWN_ENDING = ".mpo"
"""Cameras of another make say nothing of what their pictures are for; in such files they are for two eyes."""


def is_jpeg(path: Path) -> bool:
    """Whether a file begins as JPEGs do. Raises InputError where it cannot be read."""
    with open_binary(path) as file:
        return file.read(len(JPEG_START)) == JPEG_START


def is_stereo_mpo(path: Path) -> bool:
    """Whether a JPEG holds pictures for several eyes, rather than its gain map or a larger preview.

    Raises InputError for one that ends in .mpo, and is damaged or holds a single picture.
    """
    is_said = path.suffix.lower() == OWN_ENDING
    try:
        with open_with_pillow(path, *MPO) as image:
            count = getattr(image, "n_frames", 1)
            entries = getattr(image, "mpinfo", {}).get(ENTRIES_TAG, ())
            kinds = [str(entry.get("Attribute", {}).get("MPType")) for entry in entries]
    except InputError:
        if is_said:
            raise
        return False
    if is_said and count < 2:
        raise InputError(f"{path}: holds one picture only, not one for each eye; get the whole file again")
    return count >= 2 and (is_said or any(DISPARITY_TYPE in kind for kind in kinds))


def read_mpo_picture(path: Path, number: int) -> Raster:
    """Decode the picture of this number, from 0. Raises InputError where there is none, or it is damaged."""
    with open_with_pillow(path, *MPO) as image:
        image.seek(number)
        return raster_of(image)


def mpo_picture_size(path: Path, number: int) -> ImageSize:
    """As stored. Raises InputError as `read_mpo_picture` does."""
    with open_with_pillow(path, *MPO) as image:
        image.seek(number)
        return ImageSize(image.height, image.width)
