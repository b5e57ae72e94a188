"""sRGB <-> linear light, the only place where the curve is written down (IEC 61966-2-1, continued above 1 for HDR)."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.types import FloatImage, StoredColors


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
