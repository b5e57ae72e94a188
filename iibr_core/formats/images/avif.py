"""AVIF photos, which OpenImageIO's wheel does not read: Pillow decodes them."""

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from PIL.Image import Image

from iibr_core.formats.files import PARSE_ERRORS, read_bytes, require_file
from iibr_core.formats.images.iso_boxes import associations, boxes, meta_boxes, with_primary
from iibr_core.formats.images.pillow_reader import COLOR_CODES, open_with_pillow

DEPTH_TYPES = (b"urn:mpeg:mpegB:cicp:systems:auxiliary:depth", b"urn:mpeg:hevc:2015:auxid:2")
"""Types of auxiliary pictures that are depth maps, as AVIF has them and as HEIC."""


@contextmanager
def open_avif(path: Path) -> Iterator[Image]:
    """Open an AVIF and read its header, with colours in numbers, which Pillow does not pass on."""
    require_file(path)
    with open_with_pillow(path, ("AVIF",)) as image:
        codes = _color_codes(path.read_bytes())
        if codes is not None:
            image.info["nclx_profile"] = dict(zip(COLOR_CODES, codes))
        yield image


def avif_depth_file(path: Path) -> bytes | None:
    """Return an AVIF file that shows the depth map of this one, not turned by the orientation; None without."""
    data = read_bytes(path)
    try:
        for item, known in _primary_and_properties(data)[1].items():
            if any(kind == b"auxC" and content[4:].split(b"\0")[0] in DEPTH_TYPES for kind, content in known):
                return with_primary(data, item)
    except PARSE_ERRORS:
        pass
    return None


def _color_codes(data: bytes) -> tuple[int, int, int, int] | None:
    """Return the photo's colours in numbers (ITU-T H.273): primaries, curve, matrix, full range; None without."""
    try:
        primary, properties = _primary_and_properties(data)
        for kind, content in properties[primary]:
            if kind == b"colr" and content[:4] == b"nclx":
                primaries, transfer, matrix, full_range = struct.unpack_from(">HHHB", content, 4)
                return primaries, transfer, matrix, full_range >> 7
    except PARSE_ERRORS:
        pass
    return None


def _primary_and_properties(data: bytes) -> tuple[int, dict[int, list[tuple[bytes, bytes]]]]:
    """Return the number of the photo's item, and the kind and content of each item's properties."""
    meta = meta_boxes(data)
    iprp = dict(boxes(meta[b"iprp"]))
    properties = list(boxes(iprp[b"ipco"]))
    items, essential = associations(iprp[b"ipma"])
    places = {item: [number % essential for number in numbers] for item, numbers in items.items()}
    known = {item: [properties[k - 1] for k in ks if 1 <= k <= len(properties)] for item, ks in places.items()}
    return int.from_bytes(meta[b"pitm"][4:], "big"), known
