"""sRGB <-> linear light, the only place where the curve is written down (IEC 61966-2-1, continued above 1 for HDR), and
from one colour space to another.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import (
    SRGB,
    ColorSpace,
    FloatImage,
    Photo,
    StoredColors,
)

MOST_LIGHT = 1e37
"""Sums of three stay finite."""
ROWS_AT_ONCE = 64
"""Of a picture: linear light takes some times its memory."""


def linear_from_srgb(encoded: NDArray[Any]) -> FloatImage:
    """Linear light of sRGB-encoded values (float, 1 = white). Any shape; negative values count as 0."""
    x = np.maximum(np.asarray(encoded, np.float32), 0)
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4).astype(np.float32)


def srgb_from_linear(linear: NDArray[Any]) -> FloatImage:
    """sRGB-encoded values of linear light (float, 1 = white). Any shape; negative values count as 0."""
    x = np.maximum(np.asarray(linear, np.float32), 0)
    return np.where(x <= 0.0031308, x * 12.92, 1.055 * x ** (1 / 2.4) - 0.055).astype(np.float32)


def stored_from_encoded(encoded: FloatImage, is_hdr: bool) -> StoredColors:
    """Encoded float colours as they are stored in a light field: rounded uint8, or float16 for HDR."""
    if is_hdr:
        return np.clip(encoded, 0, float(np.finfo(np.float16).max)).astype(np.float16)
    return bytes_from_encoded(encoded)


def bytes_from_encoded(encoded: FloatImage) -> NDArray[np.uint8]:
    """Values of 0..1 in 8 bits, rounded; what lies beyond is moved in. Any shape."""
    return (np.clip(encoded, 0, 1) * 255 + 0.5).astype(np.uint8)


def encoded_from_stored(stored: StoredColors) -> FloatImage:
    """Encoded float colours (1 = white) of stored ones."""
    encoded: FloatImage = stored.astype(np.float32)
    return encoded / np.float32(255) if stored.dtype == np.uint8 else encoded


def quantise_as_stored(colors: FloatImage) -> FloatImage:
    """Return encoded colours rounded to bytes as a light field stores them, 1 = white."""
    return encoded_from_stored(stored_from_encoded(colors, False))


@lru_cache(maxsize=16)
def primaries_matrix(target: ColorSpace, source: ColorSpace) -> FloatImage:
    """(3, 3): linear light of `target` from linear light of `source`; white stays white, in spite of rounding."""
    matrix = np.linalg.solve(np.array(target.xyz_from_linear), np.array(source.xyz_from_linear))
    result: FloatImage = (matrix / matrix.sum(axis=1, keepdims=True)).astype(np.float32)
    result.flags.writeable = False  # it is kept
    return result


def convert(encoded: FloatImage, target: ColorSpace, source: ColorSpace) -> FloatImage:
    """Encoded colours (H, W, 3) of another space; the same array where it is this one. What `target` lacks is cut off
    at 0, and beyond the largest value there is, as HDR has no other end.
    """
    if target == source:
        return encoded
    matrix, most = primaries_matrix(target, source), max(1.0, float(encoded.max(initial=0.0)))
    result = np.empty_like(encoded)
    for first in range(0, len(encoded), ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE)
        light = np.minimum(linear_from_srgb(encoded[rows]), MOST_LIGHT)
        np.minimum(srgb_from_linear(light @ matrix.T), most, out=result[rows])
    return result


def photo_in_srgb(photo: Photo) -> Photo:
    """For what knows sRGB only; the photo itself where it is that."""
    return replace(photo, pixels=convert(photo.pixels, SRGB, photo.color_space), color_space=SRGB)
