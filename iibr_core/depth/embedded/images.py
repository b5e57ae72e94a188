"""Depth maps stored as pictures within another file: checked by their header before memory is spent."""

from __future__ import annotations

from io import BytesIO

import numpy as np
from PIL import Image

from iibr_core.depth.embedded.jpeg import JPEG_START
from iibr_core.formats.images.pillow_reader import DECODE_ERRORS
from iibr_core.types import FloatImage, InputError

MAX_MAP_PIXELS = 64_000_000
"""Largest map; no phone stores one as large as its photo."""
PNG_START, PNG_END = b"\x89PNG\r\n\x1a\n", b"IEND\xaeB`\x82"
PICTURE_STARTS = (PNG_START, JPEG_START)
GREY_TOLERANCE = 10
"""Largest difference of the channels of a grey picture, of 255: it may have been a JPEG."""


def decode_map(data: bytes, what: str, formats: tuple[str, ...] = ("PNG", "JPEG", "WEBP")) -> FloatImage:
    """Return a grey picture's values as (H, W) float32, 0..1. formats: names of Pillow's.

    Pillow decodes it: libpng, as OpenImageIO calls it, prints damage to stderr. Raises InputError if the picture is
    damaged, coloured or too large.
    """
    if data.startswith(PNG_START) and PNG_END not in data:
        raise InputError(f"{what}: cut off after {len(data):,} bytes")
    try:
        with Image.open(BytesIO(data), formats=formats) as picture:
            if not 0 < picture.width * picture.height <= MAX_MAP_PIXELS:
                raise InputError(f"{what}: {picture.width}x{picture.height} pixels are not 1 to {MAX_MAP_PIXELS:,}")
            if picture.mode in ("I;16", "I;16B", "I"):
                return np.asarray(picture, np.float32) * np.float32(1 / 65535)
            is_grey = picture.mode in ("1", "L", "LA", "P", "RGB", "RGBA")
            colors = np.asarray(picture.convert("RGB"))
    except InputError:
        raise
    except DECODE_ERRORS as error:
        raise InputError(f"{what}: is no picture, damaged or cut off ({len(data):,} bytes)") from error
    if not is_grey or (np.ptp(colors, axis=2) > GREY_TOLERANCE).any():
        raise InputError(f"{what}: is a colour picture; a depth map has one value per pixel")
    return colors[..., 0].astype(np.float32) * np.float32(1 / 255)
