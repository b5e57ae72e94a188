"""Places of a view's pixels: a file of its own, one of several pictures in a file, or a part of a picture."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.images.decode import decode, read_orientation, read_size
from iibr_core.formats.images.picture import Picture, upright
from iibr_core.types import ImageSize, InputError, image_size


class PicturePart(NamedTuple):
    """Every `step`-th pixel of a picture along each axis (y, x), from `first` on; `size` pixels in all."""

    first: tuple[int, int]
    size: ImageSize
    step: tuple[int, int] = (1, 1)


@dataclass(frozen=True)
class PictureSource:
    """A picture within a file.

    number: of the picture in its file; 0 is the one that every program shows, the order of the others depends on the
    format. part: part of the upright picture, None for all. shown_size: size that it is stretched to, None for its own.
    """

    path: Path
    number: int = 0
    part: PicturePart | None = None
    shown_size: ImageSize | None = None

    @property
    def whole(self) -> PictureSource:
        """The picture that this is a part of."""
        return PictureSource(self.path, self.number)


def source_size(source: PictureSource) -> ImageSize:
    """Return the size from the file's header: of a part as shown, of a whole picture as stored, not upright."""
    if source.shown_size is not None:
        return source.shown_size
    return read_size(source.path, source.number) if source.part is None else source.part.size


def upright_size(path: Path) -> ImageSize:
    """Return the size of a file's picture from its header, turned by its orientation."""
    size = read_size(path)
    return ImageSize(size.width, size.height) if read_orientation(path) >= 5 else size


def read_source(source: PictureSource) -> Picture:
    """Decode a picture: a part of it upright, a whole one as stored."""
    picture = decode(source.path, source.number)
    return picture if source == source.whole else part_of(picture, source)


def part_of(picture: Picture, source: PictureSource) -> Picture:
    """Return the part of a decoded picture that a source names. Raises InputError where the picture lacks it."""

    def cut(values: NDArray[Any]) -> NDArray[Any]:
        values = upright(values, picture.orientation)
        if source.part is not None:
            values = cut_part(values, source.part)
            if image_size(values) != source.part.size:
                raise InputError(f"{source.path}: is smaller than it should be; get the whole file again")
        return np.ascontiguousarray(values if source.shown_size is None else _stretch(values, source.shown_size))

    alpha = None if picture.alpha is None else cut(picture.alpha)
    return replace(picture, pixels=cut(picture.pixels), alpha=alpha, orientation=1)


def cut_part(values: NDArray[Any], part: PicturePart) -> NDArray[Any]:
    """Return a part of a picture (H, W, ...), less where the picture is smaller."""
    (top, left), (height, width), (down, across) = part
    return values[top : top + height * down : down, left : left + width * across : across]


def _stretch(values: NDArray[Any], size: ImageSize) -> NDArray[Any]:
    """Return values (H, W, ...) at another size, interpolated linearly along each axis."""
    for axis, length in enumerate(size):
        stored = values.shape[axis]
        if stored != length:
            at = np.clip((np.arange(length) + 0.5) * stored / length - 0.5, 0, stored - 1)
            low = np.minimum(at.astype(int), max(stored - 2, 0))
            share = (at - low).reshape([-1 if k == axis else 1 for k in range(values.ndim)]).astype(np.float32)
            first, second = values.take(low, axis), values.take(np.minimum(low + 1, stored - 1), axis)
            mixed = first + share * (second.astype(np.float32) - first)
            values = (np.rint(mixed) if values.dtype.kind == "u" else mixed).astype(values.dtype)
    return values
