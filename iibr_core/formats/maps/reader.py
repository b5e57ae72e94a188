"""Reads maps with one value per pixel: PFM, NPY, NPZ, those of other programs, and pictures, also in colours.

Renderers write depth as a channel of an OpenEXR picture, beside its colours; this is read, too.
"""

import itertools
import re
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import MAX_FILE_PIXELS, require_file
from iibr_core.formats.images.decode import complaint_of, open_header
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.picture import Picture, full_scale, upright
from iibr_core.formats.images.picture_source import PictureSource, read_source, shown_size
from iibr_core.formats.images.rgbd import GREY_TOLERANCE, MAX_COLORED_SHARE
from iibr_core.formats.maps.color_maps import CyclicColorsError, values_of_colors
from iibr_core.formats.maps.npy import read_named_array
from iibr_core.formats.maps.other_maps import map_fault, read_other_map
from iibr_core.formats.maps.pfm import read_pfm, read_pfm_size
from iibr_core.formats.maps.writer import KEY, MapText, text_from
from iibr_core.types import FloatImage, ImageSize, InputError, image_size

LUMA = np.array([0.299, 0.587, 0.114], np.float32)
"""Weights of red, green and blue in grey (Rec. BT.601), as JPEG and WebP store it."""
DEPTH_CHANNEL = re.compile(r"(?:.*\.)?(?:Z|depth|depth\.[YVRXZ])", re.IGNORECASE)
"""Names of the channel: `Z` by the format's convention, `ViewLayer.Depth.Z` by Blender."""
BACKGROUND = 1e9
"""Smallest distance that stands for no surface."""


@dataclass(frozen=True, eq=False)
class MapFile:
    """A map from a file, upright.

    values: (H, W) float32, NaN where the file marks values as unknown, `text.scale` and `text.offset` applied.
    numbers: how they are stored; "colours" is a map drawn in colours, its place in them, 0..1. largest: the greatest
    integer that could be stored; 1 for others. is_zero: (H, W), where an integer is 0, which may mean unknown; None
    where none is. text: meaning of the values by the file's header, None without. notes: what reading changed.
    name: of the array in an archive, "" for other files.
    """

    values: FloatImage
    numbers: Literal["floats", "integers", "colours"]
    largest: float = 1.0
    is_zero: NDArray[np.bool_] | None = None
    text: MapText | None = None
    notes: tuple[str, ...] = ()
    name: str = ""


def read_map(path: Path) -> FloatImage:
    """Return one value per pixel as (H, W) float32, upright, NaN where the file marks it as unknown.

    Floating-point files are taken as they are; in files of integers the value is the stored integer and 0 is unknown,
    as in KITTI and Middlebury, unless the file was written with its own scale. Transparent pixels are unknown too.
    """
    found = read_map_file(path)
    if found.is_zero is None or found.text is not None:
        return found.values
    return np.where(found.is_zero, np.float32(np.nan), found.values)


def read_map_file(path: Path) -> MapFile:
    """Read a map with the meaning of its values."""
    path = Path(path)
    require_file(path)
    kind = path.suffix.lower()
    if kind == ".pfm":
        return MapFile(read_pfm(path), "floats")
    if kind in (".npy", ".npz"):
        array, name = _read_numpy(path)
        with np.errstate(over="ignore"):
            values = np.array(array, np.float32)
        found = MapFile(values, "floats") if array.dtype.kind == "f" else _map_of_integers(values, array)
        return replace(found, name=name)
    other = read_other_map(path)
    if other is not None:
        return MapFile(other.values, "floats", name=other.name)
    try:
        _ = open_picture(path).header
    except InputError as error:
        raise map_fault(path, error) from error
    return read_map_picture(PictureSource(path))


def read_map_size(path: Path) -> ImageSize:
    """Return (height, width) of a map, upright; only an NPZ archive and maps of other programs are read for it."""
    kind = path.suffix.lower()
    if kind == ".pfm":
        return read_pfm_size(path)
    if kind in (".npy", ".npz"):
        return image_size(_read_numpy(path)[0])
    other = read_other_map(path)
    return shown_size(PictureSource(path)) if other is None else image_size(other.values)


def read_map_picture(source: PictureSource) -> MapFile:
    """Read a map that is a picture of a file, or a part of a picture."""
    found = _map_of_picture(source.path, read_source(source))
    text = text_from(open_picture(source.path).text(KEY))
    if text is None:
        return found
    values = found.values * np.float32(text.scale) + np.float32(text.offset)
    if found.is_zero is not None:
        values[found.is_zero] = np.nan
    return replace(found, values=values, is_zero=None, text=text)


def read_depth_channel(path: Path) -> FloatImage | None:
    """Return distances (H, W) float32, infinite without a surface; None where a file has no such channel."""
    if path.suffix.lower() != ".exr":
        return None
    source = open_header(path)
    if source is None:
        return None
    for part in itertools.takewhile(lambda part: source.seek_subimage(part, 0), itertools.count()):
        spec = source.spec()
        found = [k for k, name in enumerate(spec.channelnames) if DEPTH_CHANNEL.fullmatch(name)]
        # A map that is all of its file is no picture with depth.
        if found and (part > 0 or spec.nchannels > 2) and spec.width * spec.height <= MAX_FILE_PIXELS:
            values = source.read_image(part, 0, found[0], found[0] + 1, "float")
            if values is None:
                raise InputError(f"{path}: its depth channel is damaged ({complaint_of(source)}); get the file again")
            depth = np.asarray(values, np.float32).reshape(spec.height, spec.width)
            return np.where(depth >= BACKGROUND, np.float32(np.inf), depth)
    complaint_of(source)
    return None


def _map_of_picture(path: Path, picture: Picture) -> MapFile:
    turns = picture.orientation
    notes = (f"{path.name} was turned upright, as its Exif says.",) if turns > 1 else ()
    pixels = upright(picture.pixels if picture.wide is None else picture.wide, turns)
    grey = _grey(pixels)
    if grey is None:
        found = _map_of_colors(path, pixels)
    elif pixels.dtype.kind in "iu":
        found = _map_of_integers(grey.astype(np.float32), grey, np.iinfo(pixels.dtype).max)
    else:
        found = MapFile(grey.astype(np.float32), "floats")
    if picture.alpha is not None:
        found.values[upright(picture.alpha, turns) == 0] = np.nan
    return replace(found, notes=notes + found.notes)


def _map_of_integers(values: FloatImage, stored: NDArray[Any], largest: float = 0.0) -> MapFile:
    is_zero = stored == 0
    largest = largest or float(np.iinfo(stored.dtype).max)
    return MapFile(values, "integers", largest, is_zero if is_zero.any() else None)


def _map_of_colors(path: Path, pixels: NDArray[Any]) -> MapFile:
    try:
        found = values_of_colors(pixels) if pixels.dtype.kind == "u" else None
    except CyclicColorsError as error:
        words = "shows depth in a circle of hues (HSV), in which near and far look alike"
        raise InputError(f"{path}: {words}; save it as grey, or in the colours of turbo") from error
    if found is None:
        raise InputError(
            f"{path}: is a colour picture; a depth map has one value per pixel: save it as grey, as NPY, or in the"
            " colours of turbo, jet, inferno or viridis"
        )
    values, name = found
    note = f"{path.name} shows depth in the colours of {name}: they were read back. A grey or float map is more exact."
    return MapFile(values, "colours", notes=(note,))


def _grey(pixels: NDArray[Any]) -> NDArray[Any] | None:
    """Return (H, W) of a picture (H, W, C) whose channels are alike, up to lossy compression; None for colours."""
    first = pixels[..., 0]
    if pixels.shape[2] == 1 or all(np.array_equal(first, pixels[..., c], equal_nan=True) for c in (1, 2)):
        return first
    if pixels.dtype.kind != "u":
        return None
    differences = pixels.max(axis=2) - pixels.min(axis=2)
    if (differences > GREY_TOLERANCE * full_scale(pixels.dtype)).mean() > MAX_COLORED_SHARE:
        return None
    return np.asarray(np.rint(pixels[..., :3].astype(np.float32) @ LUMA))


def _read_numpy(path: Path) -> tuple[NDArray[Any], str]:
    """Return the stored array (H, W), without axes of length 1 beside these, and its name in an archive."""
    stored, name = read_named_array(path, MAX_FILE_PIXELS)
    idle = tuple(axis for axis, side in enumerate(stored.shape) if side == 1)[: max(stored.ndim - 2, 0)]
    values = stored.squeeze(idle)
    if values.ndim != 2 or values.size == 0:
        kind = f"{stored.dtype} of shape {stored.shape}"
        raise InputError(f"{path}: holds {kind}; a depth map is an array of numbers with shape (height, width)")
    return values, name
