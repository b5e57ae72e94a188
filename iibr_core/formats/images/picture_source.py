"""Where the pixels of a view are: a file of its own, one of several pictures in a file, or a part of a picture."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.images.avif import avif_size, is_avif, read_avif
from iibr_core.formats.images.heic import heic_size, is_heic, read_heic
from iibr_core.formats.images.lfp import is_lfp, lfp_size, read_lfp
from iibr_core.formats.images.lif import lif_picture_size, open_lif, read_lif_picture
from iibr_core.formats.images.mpo import mpo_picture_size, read_mpo_picture
from iibr_core.formats.images.oiio_reader import Raster, read_raster, read_size, upright
from iibr_core.types import ImageSize, InputError, image_size


class PicturePart(NamedTuple):
    """Of each axis, (y, x), every `step`-th pixel from `first` on; size: how many."""

    first: tuple[int, int]
    size: ImageSize
    step: tuple[int, int] = (1, 1)


@dataclass(frozen=True)
class PictureSource:
    """number: of the picture in its file; 0 is the one that every program shows, the others are as its format has it.

    part: of the upright picture, None for all. shown_size: what it is stretched to, None for its own.
    """

    path: Path
    number: int = 0
    part: PicturePart | None = None
    shown_size: ImageSize | None = None

    @property
    def whole(self) -> PictureSource:
        """The picture that it is a part of."""
        return PictureSource(self.path, self.number)


def source_size(source: PictureSource) -> ImageSize:
    """From the file's header: of a part as it is shown, of a whole picture as it is stored, before it is upright.

    Raises InputError as `read_source` does.
    """
    if source.shown_size is not None:
        return source.shown_size
    if source.part is not None:
        return source.part.size
    path, number = source.path, source.number
    if is_avif(path):
        return avif_size(path)
    if is_heic(path):
        return heic_size(path, number)
    if is_lfp(path):
        return lfp_size(path)
    if number == 0:
        return read_size(path)
    return lif_picture_size(path, number) if open_lif(path) is not None else mpo_picture_size(path, number)


def is_read_whole(path: Path) -> bool:
    """Whether a file is decoded by another library than OpenImageIO, all at once."""
    return is_avif(path) or is_heic(path) or is_lfp(path)


def read_source(source: PictureSource) -> Raster:
    """Decode a picture, and take what is wanted of it. Parts are of the upright picture; a whole one stays as it is
    stored. Raises InputError where it is missing, no picture, cut off, or absurdly large; or lacks the part.
    """
    raster = _read_whole(source.path, source.number)
    return raster if source == source.whole else part_of(raster, source)


def part_of(raster: Raster, source: PictureSource) -> Raster:
    """What a source takes of the whole picture, decoded. Raises InputError where it lacks the part."""
    turns = raster.spec.get_int_attribute("Orientation", 1)
    spec = raster.spec.copy()
    spec.attribute("Orientation", 1)

    def taken(values: NDArray[Any]) -> NDArray[Any]:
        values = upright(values, turns) if turns != 1 else values
        if source.part is not None:
            values = _cut(values, source.part, source.path)
        if source.shown_size is not None:
            values = _stretch(values, source.shown_size)
        return np.ascontiguousarray(values)

    return replace(
        raster, pixels=taken(raster.pixels), alpha=None if raster.alpha is None else taken(raster.alpha), spec=spec
    )


def _read_whole(path: Path, number: int) -> Raster:
    if is_avif(path):
        return read_avif(path)
    if is_heic(path):
        return read_heic(path, number)
    if is_lfp(path):
        return read_lfp(path)
    if number == 0:
        return read_raster(path)
    return read_lif_picture(path, number) if open_lif(path) is not None else read_mpo_picture(path, number)


def _cut(values: NDArray[Any], part: PicturePart, path: Path) -> NDArray[Any]:
    (top, left), (height, width), (down, across) = part
    cut = values[top : top + height * down : down, left : left + width * across : across]
    if image_size(cut) != part.size:
        raise InputError(f"{path}: is smaller than it should be; get the whole file again")
    return cut


def _stretch(values: NDArray[Any], size: ImageSize) -> NDArray[Any]:
    """Linear along each axis."""
    for axis, length in enumerate(size):
        own = values.shape[axis]
        if own != length:
            at = np.clip((np.arange(length) + 0.5) * own / length - 0.5, 0, own - 1)
            low = np.minimum(at.astype(int), max(own - 2, 0))
            share = (at - low).reshape([-1 if k == axis else 1 for k in range(values.ndim)]).astype(np.float32)
            first, second = values.take(low, axis), values.take(np.minimum(low + 1, own - 1), axis)
            mixed = first + share * (second.astype(np.float32) - first)
            values = (np.rint(mixed) if values.dtype.kind == "u" else mixed).astype(values.dtype)
    return values
