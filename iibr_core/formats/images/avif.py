"""AVIF photos, by Pillow; OpenImageIO's wheel reads none. They come out as rasters like all others."""

from __future__ import annotations

from pathlib import Path

from iibr_core.formats.files import open_binary, require_file
from iibr_core.formats.images.heic import COLOR_CODES
from iibr_core.formats.images.iso_boxes import color_codes_of, with_auxiliary_shown
from iibr_core.formats.images.oiio_reader import Raster
from iibr_core.formats.images.pillow_reader import ORIENTATION_TAG, open_with_pillow, raster_of
from iibr_core.types import ImageSize

BRANDS = frozenset({b"avif", b"avis"})
MOST_BRANDS_BYTES = 256
DEPTH_TYPES = (b"urn:mpeg:mpegB:cicp:systems:auxiliary:depth", b"urn:mpeg:hevc:2015:auxid:2")
"""Types of auxiliary pictures that are depth maps, as AVIF has them and as HEIC."""
AVIF = ("AVIF",), "an AVIF picture"


def is_avif(path: Path) -> bool:
    """Whether a file begins as AVIF files do, whatever its name. Raises InputError where it cannot be read."""
    with open_binary(path) as file:
        start = file.read(MOST_BRANDS_BYTES)
    size = int.from_bytes(start[:4], "big")
    return start[4:8] == b"ftyp" and not BRANDS.isdisjoint(start[k : k + 4] for k in range(8, min(size, len(start)), 4))


def read_avif(path: Path) -> Raster:
    """Decode an AVIF's photo, in 8 bits, as it is stored. Raises InputError as `read_raster` does."""
    with open_binary(path) as file:
        codes = color_codes_of(file.read())
    with open_with_pillow(path, *AVIF) as image:
        if codes is not None:  # Pillow does not pass them on
            image.info["nclx_profile"] = dict(zip(COLOR_CODES, codes))
        return raster_of(image)


def avif_size(path: Path) -> ImageSize:
    """As stored, from an AVIF's header. Raises InputError as `read_avif` does."""
    require_file(path)
    with open_with_pillow(path, *AVIF) as image:
        return ImageSize(image.height, image.width)


def avif_depth_file(path: Path) -> bytes | None:
    """Return an AVIF file that shows the depth map of this one; None without. Raises InputError where it is missing.

    The map is as it is stored, like the photo.
    """
    with open_binary(path) as file:
        return with_auxiliary_shown(file.read(), DEPTH_TYPES)


def avif_orientation(path: Path) -> int:
    """Return Exif's Orientation, 1..8, of an AVIF's photo. Raises InputError as `read_avif` does."""
    with open_with_pillow(path, *AVIF) as image:
        orientation = int(image.getexif().get(ORIENTATION_TAG, 1))
    return orientation if orientation in range(1, 9) else 1
