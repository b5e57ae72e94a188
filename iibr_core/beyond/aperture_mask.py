"""Reads a grey image as aperture mask."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import ApertureMask
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.types import InputError

MAX_SIDE = 64
"""Largest number of cells along a side, more than the aperture has samples."""
MAX_FILE_PIXELS = 16_000_000
"""Largest number of pixels of an image file."""


def read_mask(path: Path) -> ApertureMask:
    """Return the mask of an image file: grey times opacity, at most MAX_SIDE cells a side, the brightest cell open.

    Raises InputError, naming the file, if it is no picture, too large, or black.
    """
    mask = open_picture(path)
    height, width = mask.size
    if height * width > MAX_FILE_PIXELS:
        raise InputError(f"{path}: {width} x {height} is too large for an aperture. Make it smaller, such as 64 x 64.")
    picture = mask.decode()
    grey = _as_share(picture.pixels).mean(axis=2)
    if picture.alpha is not None:
        grey = grey * _as_share(picture.alpha)
    cells = _downsample(grey)
    brightest = float(cells.max())
    values = np.round(255 * cells / brightest).astype(np.uint8) if brightest > 0 else None
    if values is None:
        raise InputError(f"{path}: is black everywhere and lets no light through. White is open.")
    return ApertureMask(path.name, values.shape[0], values.shape[1], values.tobytes())


def _as_share(values: NDArray[Any]) -> NDArray[np.float64]:
    """Return values as shares, 0..1; values that are not finite count as 0."""
    full = np.iinfo(values.dtype).max if values.dtype.kind == "u" else 1
    return np.clip(np.nan_to_num(values.astype(np.float64) / full, posinf=0.0), 0, 1)


def _downsample(grey: NDArray[np.float64]) -> NDArray[np.float64]:
    """Return means over blocks, at most MAX_SIDE cells a side."""
    for axis in (0, 1):
        size = grey.shape[axis]
        cells = min(size, MAX_SIDE)
        starts = np.arange(cells) * size // cells
        counts = np.diff(np.append(starts, size))
        grey = np.add.reduceat(grey, starts, axis) / np.expand_dims(counts, 1 - axis)
    return grey
