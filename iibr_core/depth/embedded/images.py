"""Pictures that lie within another file: refused by header before memory is spent, and whole or an error."""

from __future__ import annotations

import io
import struct
import tempfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from PIL import Image, UnidentifiedImageError

from iibr_core.color import ROWS_AT_ONCE
from iibr_core.types import FloatImage, InputError

MAX_MAP_PIXELS = 64_000_000
"""No phone stores a depth map as large as its photo, let alone larger than this."""

PNG_END = b"IEND\xaeB`\x82"
PNG_START, JPEG_START = b"\x89PNG\r\n\x1a\n", b"\xff\xd8\xff"
GREY_TOLERANCE = 10
"""By how many of 255 steps the channels of a grey picture may differ: it may have been a JPEG."""

# Pillow raises these for damaged pictures; the runtime error is of AVIF.
DECODE_ERRORS = (
    RuntimeError,
    OSError,
    ValueError,
    SyntaxError,
    EOFError,
    IndexError,
    struct.error,
    zlib.error,
    MemoryError,
    Image.DecompressionBombError,
)


@contextmanager
def picture_file(data: bytes, what: str) -> Iterator[Path]:
    """A PNG's or JPEG's bytes as a file, for as long as the block runs; an InputError in it names `what` instead.

    Raises InputError for bytes that are neither.
    """
    if not data.startswith((PNG_START, JPEG_START)):
        raise InputError(f"{what} is neither a PNG nor a JPEG picture ({len(data):,} bytes)")
    with tempfile.TemporaryDirectory(prefix="iibr-") as folder:
        path = Path(folder) / ("picture.png" if data.startswith(PNG_START) else "picture.jpg")
        path.write_bytes(data)
        try:
            yield path
        except InputError as error:
            raise InputError(f"{what}: {str(error).removeprefix(f'{path}: ')}") from error


def decode_map(data: bytes, what: str, formats: tuple[str, ...] = ("PNG", "JPEG", "WEBP")) -> FloatImage:
    """Return a grey picture's values as (H, W) float32, 0..1; formats: by Pillow's names.

    Raises InputError where it is damaged, coloured or absurd.

    Decoded by Pillow: libpng, as OpenImageIO calls it, tells of damage on stderr, where it would spoil our one line.
    """
    if data.startswith(PNG_START) and PNG_END not in data:
        raise InputError(f"{what}: cut off after {len(data):,} bytes")
    try:
        with Image.open(io.BytesIO(data), formats=formats) as picture:
            width, height = picture.size
            if not 0 < width * height <= MAX_MAP_PIXELS:
                raise InputError(f"{what}: {width}x{height} pixels are not from 1 to {MAX_MAP_PIXELS:,}")
            values = _grey(picture)
    except UnidentifiedImageError as error:
        raise InputError(f"{what} is neither a PNG nor a JPEG picture ({len(data):,} bytes)") from error
    except DECODE_ERRORS as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{what}: damaged or cut off ({' '.join(str(error).split())[:120]})") from error
    if values is None:
        raise InputError(f"{what}: is a colour picture; a depth map has one value per pixel")
    return values


def _grey(picture: Image.Image) -> FloatImage | None:
    """(H, W), 0..1; None for colours."""
    if picture.mode in ("I;16", "I;16B", "I"):
        return np.asarray(picture, np.float32) * np.float32(1 / 65535)
    if picture.mode not in ("1", "L", "LA", "P", "RGB", "RGBA"):
        return None
    result = np.empty((picture.height, picture.width), np.float32)
    for top in range(0, picture.height, ROWS_AT_ONCE):
        rows = result[top : top + ROWS_AT_ONCE]
        colors = np.asarray(picture.crop((0, top, picture.width, top + len(rows))).convert("RGB"))
        if (np.ptp(colors, axis=2) > GREY_TOLERANCE).any():
            return None
        rows[:] = colors[..., 0].astype(np.float32) * np.float32(1 / 255)
    return result
