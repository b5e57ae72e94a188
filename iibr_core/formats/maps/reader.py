"""Reads single-channel maps: PFM, EXR, NPY, PNG."""

from __future__ import annotations

import math
from pathlib import Path
from typing import NamedTuple

import numpy as np

from iibr_core.color import ROWS_AT_ONCE
from iibr_core.formats.files import MAX_FILE_PIXELS, require_file
from iibr_core.formats.images.oiio_reader import PictureRows, Raster
from iibr_core.formats.maps.npy import read_array, read_array_header
from iibr_core.formats.maps.pfm import read_pfm, read_pfm_size
from iibr_core.types import FloatImage, ImageSize, InputError


class MapHeader(NamedTuple):
    """size: of the map. bytes_beside: what reading it holds of each pixel, beside the map itself."""

    size: ImageSize
    bytes_beside: int


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
    picture = PictureRows(path)
    result = np.empty(picture.size, np.float32)
    for first in range(0, len(result), ROWS_AT_ONCE):
        rows = result[first : first + ROWS_AT_ONCE]
        rows[:] = _values(path, picture.read(first, first + len(rows)))
    return result


def read_map_header(path: Path) -> MapHeader:
    """Of a map that `read_map` reads. Raises InputError as that does for its header."""
    if path.suffix.lower() == ".pfm":
        return MapHeader(read_pfm_size(path), 0)
    if path.suffix.lower() == ".npy":
        shape, dtype = read_array_header(path)
        size = ImageSize(*shape) if len(shape) == 2 else ImageSize(math.prod(shape), 1)
        return MapHeader(size, dtype.itemsize)
    return MapHeader(PictureRows(path).size, 0)


def _values(path: Path, raster: Raster) -> FloatImage:
    """Of some rows of a picture."""
    first = raster.pixels[..., 0]
    others = (raster.pixels[..., channel] for channel in range(1, raster.pixels.shape[2]))
    if not all(np.array_equal(first, other, equal_nan=first.dtype.kind == "f") for other in others):
        raise InputError(f"{path}: is a colour picture; a disparity map has one value per pixel")
    values = first.astype(np.float32)
    if first.dtype.kind == "u":
        values[first == 0] = np.nan
    if raster.alpha is not None:
        values[raster.alpha == 0] = np.nan
    return values


def _read_npy(path: Path) -> FloatImage:
    stored = read_array(path, MAX_FILE_PIXELS)
    if stored.ndim != 2 or stored.size == 0:
        what = f"{stored.dtype} of shape {stored.shape}"
        raise InputError(f"{path}: holds {what}; a disparity map is an array of numbers with shape (height, width)")
    with np.errstate(over="ignore"):
        return np.ascontiguousarray(stored, np.float32)
