"""AVIF photos, which OpenImageIO's wheel does not read: Pillow decodes them."""

from __future__ import annotations

from contextlib import AbstractContextManager
from pathlib import Path

from PIL.Image import Image

from iibr_core.formats.files import open_binary, require_file
from iibr_core.formats.images.iso_boxes import color_codes_of, with_auxiliary_shown
from iibr_core.formats.images.picture import Picture
from iibr_core.formats.images.pillow_reader import COLOR_CODES, open_with_pillow, orientation_of, picture_of

BRANDS = frozenset({b"avif", b"avis"})
MAX_BRANDS_BYTES = 256
DEPTH_TYPES = (b"urn:mpeg:mpegB:cicp:systems:auxiliary:depth", b"urn:mpeg:hevc:2015:auxid:2")
"""Types of auxiliary pictures that are depth maps, as AVIF has them and as HEIC."""


def is_avif(path: Path) -> bool:
    """Return whether a file begins as AVIF files do, whatever its name. Raises InputError where it cannot be read."""
    with open_binary(path) as file:
        start = file.read(MAX_BRANDS_BYTES)
    size = int.from_bytes(start[:4], "big")
    return start[4:8] == b"ftyp" and not BRANDS.isdisjoint(start[k : k + 4] for k in range(8, min(size, len(start)), 4))


def open_avif(path: Path) -> AbstractContextManager[Image]:
    """Open an AVIF and read its header. Raises InputError where it is missing, damaged or too large."""
    require_file(path)
    return open_with_pillow(path, ("AVIF",), "an AVIF picture")


def read_avif(path: Path) -> Picture:
    """Decode an AVIF's photo, in 8 bits, as stored. Raises InputError as `open_avif` does."""
    with open_binary(path) as file:
        codes = color_codes_of(file.read())
    with open_avif(path) as image:
        if codes is not None:  # Pillow does not pass them on
            image.info["nclx_profile"] = dict(zip(COLOR_CODES, codes))
        return picture_of(image)


def avif_depth_file(path: Path) -> bytes | None:
    """Return an AVIF file that shows the depth map of this one; None without. Raises InputError where it is missing.

    The map is not turned by the orientation, like the photo.
    """
    with open_binary(path) as file:
        return with_auxiliary_shown(file.read(), DEPTH_TYPES)


def avif_orientation(path: Path) -> int:
    """Return Exif's Orientation, 1..8, of an AVIF's photo. Raises InputError as `open_avif` does."""
    with open_avif(path) as image:
        return orientation_of(image)
