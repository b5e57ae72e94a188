"""What a photo's header tells before it is decoded: its size, and what its format makes decoders hold all at once."""

from __future__ import annotations

from pathlib import Path
from typing import NamedTuple

from iibr_core.formats.files import open_binary
from iibr_core.formats.images.jpeg_segments import jpeg_segments
from iibr_core.formats.images.oiio_reader import PictureRows
from iibr_core.formats.images.picture_source import PictureSource, is_read_whole, source_size
from iibr_core.formats.images.side_by_side import own_picture
from iibr_core.types import ImageSize

BY_ROWS = frozenset({"jpeg", "png", "tiff", "openexr", "hdr", "pnm", "bmp", "targa"})
"""Formats, by OpenImageIO's names, that are decoded some rows at a time; of the others all is held at once."""
HEIC_BYTES = 8
"""Of a pixel: libheif's planes, and what it makes of them; libavif's are no more."""
PART_BYTES = 6
"""Of a pixel of a picture of which a part is taken: 16 bits a channel at most."""
COEFFICIENT_BYTES = 2
PROGRESSIVE_FRAMES = (0xC2, 0xC6, 0xCA, 0xCE)
PNG_INTERLACE_AT, MOST_TILE_ROWS = 28, 1024


class PhotoHeader(NamedTuple):
    """size: as stored, before it is turned upright. decoding_bytes: what decoding it holds beside a few rows."""

    size: ImageSize
    decoding_bytes: int


def read_photo_header(path: Path) -> PhotoHeader:
    """Of a photo that `read_photo` reads. Raises InputError as that does for its header."""
    own = own_picture(path)
    header = _whole_header(path)
    if own.part is None:
        return header
    # Parts are cut out of the whole picture.
    whole_bytes = header.size.height * header.size.width * PART_BYTES
    return PhotoHeader(source_size(own), header.decoding_bytes + whole_bytes)


def _whole_header(path: Path) -> PhotoHeader:
    if is_read_whole(path):
        size = source_size(PictureSource(path))
        return PhotoHeader(size, size.height * size.width * HEIC_BYTES)
    rows = PictureRows(path)
    size, kind, pixels = rows.size, rows.format_name, rows.size.height * rows.size.width
    if kind == "jpeg":
        return PhotoHeader(size, round(pixels * _coefficient_bytes(path)))
    is_whole = kind not in BY_ROWS or (kind == "png" and _is_interlaced(path)) or rows.spec.tile_height > MOST_TILE_ROWS
    return PhotoHeader(size, int(rows.spec.image_bytes()) if is_whole else 0)


def _is_interlaced(path: Path) -> bool:
    with open_binary(path) as file:
        header = file.read(PNG_INTERLACE_AT + 1)
    return len(header) > PNG_INTERLACE_AT and header[PNG_INTERLACE_AT] == 1


def _coefficient_bytes(path: Path) -> float:
    """A progressive JPEG's coefficients, bytes a pixel: it has them all before it has any row. 0 for others."""
    with open_binary(path) as file:
        frames = (content for marker, content in jpeg_segments(file) if marker in PROGRESSIVE_FRAMES)
        frame = next(frames, None)
    return 0.0 if frame is None else _samples_a_pixel(frame) * COEFFICIENT_BYTES


def _samples_a_pixel(frame: bytes) -> float:
    """Of all components of a frame header, each sampled so many times across and down."""
    if len(frame) < 9:
        return 4.0
    factors = [(frame[at] >> 4, frame[at] & 15) for at in range(7, min(len(frame), 6 + 3 * frame[5]), 3)]
    if not factors or min(map(min, factors)) < 1:
        return 4.0
    most_across, most_down = (max(values) for values in zip(*factors))
    return float(sum(across * down for across, down in factors) / (most_across * most_down))
