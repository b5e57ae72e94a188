"""Arrays that somebody gives, as the core takes pictures."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import encoded_from_stored
from iibr_core.formats.images.photo import focal_px_from_fov
from iibr_core.types import FloatImage, InputError, Photo


def photo_of(pixels: NDArray[Any], focal_px: float | None = None, name: str = "photo") -> Photo:
    """Return a photo of (H, W, 3), uint8 or float with 1 = white. Raises InputError for any other array."""
    pixels = np.asarray(pixels)
    if pixels.ndim != 3 or pixels.shape[2] != 3 or not pixels.size:
        raise InputError(f"a photo of shape {pixels.shape}: give (H, W, 3)")
    given = np.maximum(encoded(pixels), 0)
    if not np.isfinite(given).all():
        raise InputError(f"{name}: holds colours that are NaN or infinite; give finite ones")
    return Photo(given, focal_px or focal_px_from_fov(pixels.shape[1]), name, is_hdr=bool(given.max() > 1))


def encoded(pixels: NDArray[Any]) -> FloatImage:
    """float32, 1 = white."""
    with np.errstate(over="ignore"):
        return encoded_from_stored(pixels) if pixels.dtype == np.uint8 else pixels.astype(np.float32)
