"""AVIF photos, which OpenImageIO's wheel does not read: Pillow decodes them."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL.Image import Image

from iibr_core.formats.files import open_binary, require_file
from iibr_core.formats.images.iso_boxes import color_codes_of, with_auxiliary_shown
from iibr_core.formats.images.pillow_reader import COLOR_CODES, open_with_pillow, orientation_of

BRANDS = frozenset({b"avif", b"avis"})
MAX_BRANDS_BYTES = 256
DEPTH_TYPES = (b"urn:mpeg:mpegB:cicp:systems:auxiliary:depth", b"urn:mpeg:hevc:2015:auxid:2")
"""Types of auxiliary pictures that are depth maps, as AVIF has them and as HEIC."""


def is_avif(path: Path) -> bool:
    """Return whether a file begins as AVIF files do, whatever its name."""
    with open_binary(path) as file:
        start = file.read(MAX_BRANDS_BYTES)
    size = int.from_bytes(start[:4], "big")
    return start[4:8] == b"ftyp" and not BRANDS.isdisjoint(start[k : k + 4] for k in range(8, min(size, len(start)), 4))


@contextmanager
def open_avif(path: Path) -> Iterator[Image]:
    """Open an AVIF and read its header, with colours in numbers, which Pillow does not pass on."""
    require_file(path)
    with open_with_pillow(path, ("AVIF",), "an AVIF picture") as image:
        codes = color_codes_of(path.read_bytes())
        if codes is not None:
            image.info["nclx_profile"] = dict(zip(COLOR_CODES, codes))
        yield image


def avif_depth_file(path: Path) -> bytes | None:
    """Return an AVIF file that shows the depth map of this one, not turned by the orientation; None without."""
    with open_binary(path) as file:
        return with_auxiliary_shown(file.read(), DEPTH_TYPES)


def avif_orientation(path: Path) -> int:
    """Return Exif's Orientation, 1..8, of an AVIF's photo."""
    with open_avif(path) as image:
        return orientation_of(image)
