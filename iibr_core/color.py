"""Conversions between sRGB encoding (IEC 61966-2-1, continued above 1 for HDR) and linear light, and between colour
spaces. This is the only place with the formula of the curve.
"""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import SRGB, ColorSpace, FloatImage, Photo, StoredColors

MAX_LIGHT = 1e37
"""Largest linear light in conversions: sums of three channels stay finite."""
ROWS_AT_ONCE = 64
"""Number of a picture's rows that are converted at once: linear light takes several times its memory."""


def linear_from_srgb(encoded: NDArray[Any]) -> FloatImage:
    """Return linear light of sRGB-encoded values (float, 1 = white) of any shape; negative values count as 0."""
    x = np.maximum(np.asarray(encoded, np.float32), 0)
    return np.where(x <= 0.04045, x / 12.92, ((x + 0.055) / 1.055) ** 2.4).astype(np.float32)


def srgb_from_linear(linear: NDArray[Any]) -> FloatImage:
    """Return sRGB-encoded values of linear light (float, 1 = white) of any shape; negative values count as 0."""
    x = np.maximum(np.asarray(linear, np.float32), 0)
    return np.where(x <= 0.0031308, x * 12.92, 1.055 * x ** (1 / 2.4) - 0.055).astype(np.float32)


def stored_from_encoded(encoded: FloatImage, is_hdr: bool) -> StoredColors:
    """Return encoded float colours in the type of a light field's views: rounded uint8, or float16 for HDR."""
    if is_hdr:
        return np.clip(encoded, 0, float(np.finfo(np.float16).max)).astype(np.float16)
    return bytes_from_encoded(encoded)


def bytes_from_encoded(encoded: FloatImage) -> NDArray[np.uint8]:
    """Return values of any shape, clipped to 0..1, as rounded bytes."""
    return (np.clip(encoded, 0, 1) * 255 + 0.5).astype(np.uint8)


def encoded_from_stored(stored: StoredColors) -> FloatImage:
    """Return stored colours as floats, 1 = white."""
    encoded: FloatImage = stored.astype(np.float32)
    return encoded / np.float32(255) if stored.dtype == np.uint8 else encoded


def quantise_as_stored(colors: FloatImage) -> FloatImage:
    """Return encoded colours rounded to bytes as a light field stores them, 1 = white."""
    return encoded_from_stored(stored_from_encoded(colors, False))


@lru_cache(maxsize=16)
def primaries_matrix(target: ColorSpace, source: ColorSpace) -> FloatImage:
    """Return the matrix from linear light of `source` to that of `target`; white stays exactly white."""
    matrix = np.linalg.solve(np.array(target.xyz_from_linear), np.array(source.xyz_from_linear))
    result: FloatImage = (matrix / matrix.sum(axis=1, keepdims=True)).astype(np.float32)
    result.flags.writeable = False  # it is cached
    return result


def convert(encoded: FloatImage, target: ColorSpace, source: ColorSpace) -> FloatImage:
    """Return encoded colours (H, W, 3) in another space; the same array if the spaces are equal.

    Colours that `target` lacks are clipped to 0 and the largest value of the picture, at least 1.
    """
    if target == source:
        return encoded
    matrix, most = primaries_matrix(target, source), max(1.0, float(encoded.max(initial=0.0)))
    result = np.empty_like(encoded)
    for first in range(0, len(encoded), ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE)
        light = np.minimum(linear_from_srgb(encoded[rows]), MAX_LIGHT)
        np.minimum(srgb_from_linear(light @ matrix.T), most, out=result[rows])
    return result


def photo_in_srgb(photo: Photo) -> Photo:
    """Return the photo with its colours in sRGB."""
    return replace(photo, pixels=convert(photo.pixels, SRGB, photo.color_space), color_space=SRGB)
