"""Places of pixels: a file of its own, one of several pictures in a file, a part of a picture; and small copies."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iibr_core.color import bytes_from_encoded
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.picture import Picture, full_scale, turned_size, upright
from iibr_core.formats.images.pillow_reader import DECODE_ERRORS
from iibr_core.types import ImageSize, InputError, image_size

DEEP_MODES = ("I", "F")
"""Modes of Pillow whose values it does not bring to 8 bits."""


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
    return open_picture(source.path).header_of(source.number).size if source.part is None else source.part.size


def shown_size(source: PictureSource) -> ImageSize:
    """Return the size from the file's header, as shown: a whole picture is turned by its orientation."""
    size = source_size(source)
    if source != source.whole:
        return size
    return turned_size(size, open_picture(source.path).header_of(source.number).orientation)


def read_source(source: PictureSource) -> Picture:
    """Decode a picture: a part of it upright, a whole one as stored. Raises InputError if its file is cut off."""
    picture = open_picture(source.path).decode(source.number)
    if picture.is_cut_off:
        raise InputError(f"{source.path}: cut off; get the whole file again")
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
    return replace(picture, pixels=cut(picture.pixels), alpha=alpha, wide=None, orientation=1)


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


def small_picture(path: Path, within: ImageSize) -> NDArray[np.uint8] | None:
    """Return means of colours as stored, (h, w, 3), upright, within a size; None for files that Pillow cannot read."""
    with suppress(*DECODE_ERRORS), Image.open(path) as picture:
        picture.draft("RGB", (2 * max(within), 2 * max(within)))
        if picture.mode.startswith(DEEP_MODES):
            return None
        orientation = open_picture(path).orientation
        return upright(_resized(picture.convert("RGB"), turned_size(within, orientation)), orientation)
    return None


def small_decoded_picture(path: Path, longest_px: int) -> NDArray[np.uint8]:
    """Return the same of any picture that can be read, which may take as long as that."""
    within = ImageSize(longest_px, longest_px)
    if (small := small_picture(path, within)) is not None:
        return small
    whole = open_picture(path).decode()
    step = max(max(whole.size) // (4 * longest_px), 1)
    colors = whole.pixels[::step, ::step].astype(np.float32) / np.float32(full_scale(whole.pixels.dtype))
    encoded = bytes_from_encoded(np.nan_to_num(colors))
    picture = Image.fromarray(np.broadcast_to(encoded, (*encoded.shape[:2], 3)).copy())
    return upright(_resized(picture, within), whole.orientation)


def _resized(picture: Image.Image, within: ImageSize) -> NDArray[np.uint8]:
    ratio = max(picture.height / within.height, picture.width / within.width, 1.0)
    width, height = (max(round(side / ratio), 2) for side in picture.size)
    return np.asarray(picture.resize((width, height), Image.Resampling.BOX))
