"""Reads maps with one value per pixel: PFM, NPY, NPZ, and every kind of picture, also one that shows it in colours."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import MAX_FILE_PIXELS, require_file
from iibr_core.formats.images.decode import read_text
from iibr_core.formats.images.picture import Picture, full_scale, upright
from iibr_core.formats.images.picture_source import PictureSource, read_source, source_size
from iibr_core.formats.maps.color_maps import values_of_colors
from iibr_core.formats.maps.map_text import KEY, MapText, text_from
from iibr_core.formats.maps.npy import npz_member, read_array, read_array_header
from iibr_core.formats.maps.pfm import read_pfm, read_pfm_size
from iibr_core.types import FloatImage, ImageSize, InputError

GREY_TOLERANCE = 16 / 255
"""The channels of a grey picture differ by less than this share of white: lossy compression shifts them."""
MOST_COLORED = 0.01
"""A grey picture has no larger share of pixels that differ by more."""
LUMA = np.array([0.299, 0.587, 0.114], np.float32)
"""Weights of red, green and blue in grey (Rec. BT.601), as JPEG and WebP store it."""


class MapHeader(NamedTuple):
    """size: of the map. bytes_beside: what reading it holds of each pixel, beside the map itself."""

    size: ImageSize
    bytes_beside: int


@dataclass(frozen=True, eq=False)
class MapFile:
    """A map from a file, upright.

    values: (H, W) float32, NaN where the file marks values as unknown, `text.scale` and `text.offset` applied.
    numbers: how they are stored; "colours" is a map drawn in colours, its place in them, 0..1. largest: the greatest
    integer that could be stored; 1 for others. is_zero: (H, W), where an integer is 0, which may mean unknown; None
    where none is. text: what the program that wrote it says of it, None without. notes: what reading changed.
    """

    values: FloatImage
    numbers: Literal["floats", "integers", "colours"]
    largest: float = 1.0
    is_zero: NDArray[np.bool_] | None = None
    text: MapText | None = None
    notes: tuple[str, ...] = ()


def read_map(path: Path) -> FloatImage:
    """Return one value per pixel as (H, W) float32, upright, NaN where the file marks it as unknown.

    Floating-point files are taken as they are; in files of integers the value is the stored integer and 0 is unknown,
    as in KITTI and Middlebury, unless the file was written with its own scale. Where a picture has alpha, 0 means
    unknown too. Raises InputError for colour pictures and as `decode` and `read_pfm` do.
    """
    found = read_map_file(path)
    if found.is_zero is None or found.text is not None:
        return found.values
    return np.where(found.is_zero, np.float32(np.nan), found.values)


def read_map_file(path: Path) -> MapFile:
    """Read a map with the meaning of its values. Raises InputError as `read_map` does."""
    path = Path(path)
    require_file(path)
    kind = path.suffix.lower()
    if kind == ".pfm":
        return MapFile(read_pfm(path), "floats")
    if kind in (".npy", ".npz"):
        return _read_numpy(path)
    return read_map_picture(PictureSource(path))


def read_map_picture(source: PictureSource) -> MapFile:
    """A map that is a picture of a file, or a part of one. Raises InputError as `read_map` does."""
    found = _of_picture(source.path, read_source(source))
    return _in_its_own_units(found, text_from(read_text(source.path, KEY)))


def read_map_header(path: Path) -> MapHeader:
    """Return the header of a map that `read_map` reads. Raises InputError as that does."""
    kind = path.suffix.lower()
    if kind == ".pfm":
        return MapHeader(read_pfm_size(path), 0)
    if kind in (".npy", ".npz"):
        shape, dtype = read_array_header(path, npz_member(path) if kind == ".npz" else "")
        sides = [side for side in shape if side != 1] if len(shape) > 2 else list(shape)
        return MapHeader(ImageSize(*sides) if len(sides) == 2 else ImageSize(math.prod(shape), 1), dtype.itemsize)
    source = PictureSource(path)
    return MapHeader(source_size(source), 0)


def _of_picture(path: Path, picture: Picture) -> MapFile:
    turns = picture.orientation
    notes = (f"{path.name} was turned upright, as its Exif says.",) if turns > 1 else ()
    pixels = upright(picture.pixels, turns)
    unknown = None if picture.alpha is None else upright(picture.alpha, turns) == 0
    grey = _grey(pixels)
    if grey is None:
        return _of_colors(path, pixels, unknown, notes)
    values = grey.astype(np.float32)
    if unknown is not None:
        values[unknown] = np.nan
    if pixels.dtype.kind != "u":
        return MapFile(values, "floats", notes=notes)
    is_zero = grey == 0
    return MapFile(values, "integers", full_scale(pixels.dtype), is_zero if is_zero.any() else None, notes=notes)


def _grey(pixels: NDArray[Any]) -> NDArray[Any] | None:
    """(H, W) of a picture (H, W, C) whose channels are alike, up to lossy compression; None for colours."""
    first = pixels[..., 0]
    if pixels.shape[2] == 1 or all(np.array_equal(first, pixels[..., c], equal_nan=True) for c in (1, 2)):
        return first
    if pixels.dtype.kind != "u":
        return None
    apart = pixels.max(axis=2) - pixels.min(axis=2)
    if (apart > GREY_TOLERANCE * full_scale(pixels.dtype)).mean() > MOST_COLORED:
        return None
    return np.asarray(np.rint(pixels[..., :3].astype(np.float32) @ LUMA))


def _of_colors(path: Path, pixels: NDArray[Any], unknown: NDArray[np.bool_] | None, notes: tuple[str, ...]) -> MapFile:
    found = values_of_colors(pixels) if pixels.dtype.kind == "u" else None
    if found is None:
        raise InputError(f"{path}: is a colour picture; a depth map has one value per pixel: save it as grey")
    values, name = found
    if unknown is not None:
        values[unknown] = np.nan
    said = f"{path.name} shows depth in the colours of {name}: they were read back. A grey or float map is more exact."
    return MapFile(values, "colours", notes=(*notes, said))


def _in_its_own_units(found: MapFile, text: MapText | None) -> MapFile:
    """The map in the units of its text: 0 is unknown where the values were written as integers."""
    if text is None:
        return found
    values = found.values * np.float32(text.scale) + np.float32(text.offset)
    if found.is_zero is not None:
        values[found.is_zero] = np.nan
    return MapFile(values, found.numbers, found.largest, None, text, found.notes)


def _read_numpy(path: Path) -> MapFile:
    member = npz_member(path) if path.suffix.lower() == ".npz" else ""
    stored = read_array(path, MAX_FILE_PIXELS, member)
    idle = tuple(axis for axis, side in enumerate(stored.shape) if side == 1)[: max(stored.ndim - 2, 0)]
    values = stored.squeeze(idle)
    if values.ndim != 2 or values.size == 0:
        what = f"{stored.dtype} of shape {stored.shape}"
        raise InputError(f"{path}: holds {what}; a depth map is an array of numbers with shape (height, width)")
    with np.errstate(over="ignore"):
        floats = np.ascontiguousarray(values, np.float32)
    if values.dtype.kind == "f":
        return MapFile(floats, "floats")
    is_zero = values == 0
    largest = float(np.iinfo(values.dtype).max)
    return MapFile(floats, "integers", largest, is_zero if is_zero.any() else None)
