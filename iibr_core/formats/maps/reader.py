"""Reads single-channel maps: PFM, EXR, NPY, PNG."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import MAX_FILE_PIXELS, require_file
from iibr_core.formats.images.oiio_reader import read_raster
from iibr_core.formats.maps.npy import read_array
from iibr_core.formats.maps.pfm import read_pfm
from iibr_core.types import FloatImage, InputError


def read_map(path: Path) -> FloatImage:
    """One value per pixel as (H, W) float32, NaN where the file says that it is unknown.

    PFM, NPY (2-D, numbers) and floating-point pictures are taken as they are; in 8- and 16-bit pictures the value is
    the stored integer and 0 is unknown, as in KITTI and Middlebury. Where a picture has alpha, 0 means unknown too.
    Raises InputError for colour pictures and as `read_raster` and `read_pfm` do.
    """
    require_file(path)
    if path.suffix.lower() == ".pfm":
        return read_pfm(path)
    if path.suffix.lower() == ".npy":
        return _read_npy(path)
    raster = read_raster(path)
    first = raster.pixels[..., 0]
    if not all(np.array_equal(first, other, equal_nan=first.dtype.kind == "f") for other in _others(raster.pixels)):
        raise InputError(f"{path}: is a colour picture; a disparity map has one value per pixel")
    values = first.astype(np.float32)
    if first.dtype.kind == "u":
        values[first == 0] = np.nan
    if raster.alpha is not None:
        values[raster.alpha == 0] = np.nan
    return values


def _others(pixels: NDArray[Any]) -> list[NDArray[Any]]:
    return [pixels[..., channel] for channel in range(1, pixels.shape[2])]


def _read_npy(path: Path) -> FloatImage:
    stored = read_array(path, MAX_FILE_PIXELS)
    if stored.ndim != 2 or stored.size == 0:
        what = f"{stored.dtype} of shape {stored.shape}"
        raise InputError(f"{path}: holds {what}; a disparity map is an array of numbers with shape (height, width)")
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(stored, np.float32)
