"""A grey image as aperture: read, made small, refused where it would let no light through."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.beyond.optics import ApertureMask
from iibr_core.formats.images.decode import decode, read_size
from iibr_core.types import InputError

LARGEST_SIDE = 64
"""Cells of the aperture; more than there are samples in it."""

MOST_FILE_PIXELS = 16_000_000


def read_mask(path: Path) -> ApertureMask:
    """The mask of an image file: grey, opaque parts only, at most LARGEST_SIDE each way, the brightest cell open.

    Raises InputError, naming the file, if it is no picture, far too large, or black all over.
    """
    height, width = read_size(path)
    if height * width > MOST_FILE_PIXELS:
        raise InputError(f"{path}: {width}x{height} is far too large for an aperture; make it small, 64x64 is plenty")
    picture = decode(path)
    grey = _as_share(picture.pixels).mean(axis=2)
    if picture.alpha is not None:
        grey = grey * _as_share(picture.alpha)
    cells = _downsample(grey)
    brightest = float(cells.max())
    values = np.round(255 * cells / brightest).astype(np.uint8) if brightest > 0 else None
    if values is None:
        raise InputError(f"{path}: is black all over and would let no light through; white is open")
    return ApertureMask(path.name, values.shape[0], values.shape[1], values.tobytes())


def _as_share(values: NDArray[Any]) -> NDArray[np.float64]:
    """0..1; what is not finite lets no light through."""
    full = np.iinfo(values.dtype).max if values.dtype.kind == "u" else 1
    return np.clip(np.nan_to_num(values.astype(np.float64) / full, posinf=0.0), 0, 1)


def _downsample(grey: NDArray[np.float64]) -> NDArray[np.float64]:
    """Means over blocks, so that neither side has more than LARGEST_SIDE cells."""
    for axis in (0, 1):
        size = grey.shape[axis]
        cells = min(size, LARGEST_SIDE)
        starts = np.arange(cells) * size // cells
        counts = np.diff(np.append(starts, size))
        grey = np.add.reduceat(grey, starts, axis) / np.expand_dims(counts, 1 - axis)
    return grey
