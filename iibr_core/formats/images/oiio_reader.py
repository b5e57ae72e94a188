"""Decodes picture files, the one place that reads through OpenImageIO: refused by header before memory is spent, and
whole or an error.
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from iibr_core.color import ROWS_AT_ONCE
from iibr_core.formats.files import MAX_FILE_PIXELS, open_binary, reason_of, refuse_bomb, require_file
from iibr_core.formats.images.file_kinds import raw_kind, unreadable_kind
from iibr_core.formats.images.oiio_names import oiio_name
from iibr_core.types import ImageSize, InputError, image_size

# Some cameras pad their JPEGs; the decoder complains and loses nothing.
HARMLESS_MESSAGE = "extraneous bytes"
NO_READER = "could not find a format reader"
"""OpenImageIO's words for a file of a kind that it does not know."""
MOST_PNG_SIDE = 1_000_000
"""As libpng has it."""
FLOATING_TYPES = ("half", "float", "double")
LINEAR_TRANSFERS = (2, 8)
"""Transfer curves of ITU-T H.273 that leave light as it is: "unspecified" and "linear"."""
MAX_ICON_PICTURES = 100
READABLE_FORMATS = str(oiio.get_string_attribute("input_format_list")).split(",")
PNG_ENDINGS = (".png", ".pns")
PNG_START = b"\x89PNG\r\n\x1a\n"


@dataclass(frozen=True, eq=False)
class Raster:
    """What a picture file holds.

    pixels: (H, W, C) without alpha, C = 1 or 3; uint8, uint16, or float32 for every floating-point file. alpha: (H, W)
    of the same type, or None where all is opaque. spec: OpenImageIO's header; its "oiio:UnassociatedAlpha" is set where
    pixels are not multiplied by alpha.
    """

    pixels: NDArray[Any]
    alpha: NDArray[Any] | None
    spec: Any

    is_at_start = True
    """All rows may be read again, unlike those of a file that is being read (`PictureRows`)."""

    @property
    def size(self) -> ImageSize:
        """Of the pixels."""
        return image_size(self.pixels)

    def read(self, first: int, last: int) -> Raster:
        """Rows [first, last)."""
        alpha = None if self.alpha is None else self.alpha[first:last]
        return Raster(self.pixels[first:last], alpha, self.spec)


def read_size(path: Path) -> ImageSize:
    """From a picture file's header. Raises InputError as `read_raster` does."""
    spec = _open(path).spec()
    return ImageSize(spec.height, spec.width)


def read_orientation(path: Path) -> int:
    """Exif's Orientation, 1..8, from a picture file's header; 1 where it tells none or cannot be read."""
    source = oiio.ImageInput.open(oiio_name(path))
    if source is None:
        complaint_of(oiio)
        return 1
    return int(source.spec().get_int_attribute("Orientation", 1))


def upright(pixels: NDArray[Any], orientation: int) -> NDArray[Any]:
    """Turn stored (H, W, ...) pixels as Exif's Orientation 1..8 says; other values leave them alone."""
    if orientation >= 5 and orientation <= 8:
        pixels = pixels.swapaxes(0, 1)
    if orientation in (3, 4, 7, 8):
        pixels = pixels[::-1]
    if orientation in (2, 3, 6, 7):
        pixels = pixels[:, ::-1]
    return np.ascontiguousarray(pixels)


class PictureRows:
    """A picture file, open to be read from top to bottom, some rows at a time: no more of it is in memory than that,
    as far as its format allows.

    spec: OpenImageIO's header. format_name: its name for the format. size: of the picture. is_at_start: whether nothing
    was read yet.
    """

    def __init__(self, path: Path) -> None:
        """Read the header. Raises InputError as `read_raster` does."""
        self._path = path
        self._source = _open(path)
        self.spec = _spec_of_whole_numbers(self._source.spec())
        self.format_name = str(self._source.format_name())
        self.size = ImageSize(self.spec.height, self.spec.width)
        self._colors, self._alpha_at = _channels(path, self.spec)
        self._type = _reading_type(self.spec.format)
        self.is_at_start = True
        self._first, self._kept = 0, np.empty((0, self.size.width, self._channel_count), self._type)

    @property
    def _channel_count(self) -> int:
        return max(self._colors, self._alpha_at + 1)

    def read(self, first: int, last: int) -> Raster:
        """Rows [first, last): none that lie above those of the call before, none left out. Raises InputError.

        Its alpha is None where these rows are opaque.
        """
        self.is_at_start = False
        self._kept, self._first = self._kept[max(first - self._first, 0) :], first
        end = first + len(self._kept)
        if last > end:
            step = self.spec.tile_height or ROWS_AT_ONCE
            # Whole rows of tiles and strips, or they would be decoded again for the rows that follow.
            until = min(-(-last // step) * step, self.size.height)
            rows = self._decode(end, until)
            self._kept = np.concatenate([self._kept, rows]) if len(self._kept) else rows
        rows = self._kept[: last - first]
        alpha = np.ascontiguousarray(rows[..., self._alpha_at]) if self._alpha_at >= 0 else None
        if alpha is not None and (alpha >= full_scale(alpha.dtype)).all():
            alpha = None
        return Raster(rows[..., : self._colors], alpha, self.spec)

    def _decode(self, first: int, last: int) -> NDArray[Any]:
        """Rows [first, last) of all channels that are wanted."""
        source, spec, channels = self._source, self.spec, (0, self._channel_count, self._type)
        # A header may place its picture anywhere; rows are counted from there.
        top, bottom = spec.y + first, spec.y + last
        if spec.tile_width:
            rows = source.read_tiles(spec.x, spec.x + spec.width, top, bottom, spec.z, spec.z + 1, *channels)
        else:
            rows = source.read_scanlines(top, bottom, spec.z, *channels)
        message = complaint_of(source)
        if rows is None or (message and HARMLESS_MESSAGE not in message):
            reason = _reason(message, self._path)
            raise InputError(f"{self._path}: damaged or cut off ({reason}); get the whole file again")
        return np.asarray(rows).reshape(last - first, self.size.width, self._channel_count)


def read_raster(path: Path) -> Raster:
    """Decode the first picture of a file, as it is stored: no colour conversion, no orientation.

    Alpha stays unmultiplied where the file has it so; palettes and CMYK come out as RGB. Raises InputError if the file
    is missing, no picture, cut off, or larger than MAX_FILE_PIXELS.
    """
    rows = PictureRows(path)
    return rows.read(0, rows.size.height)


def _channels(path: Path, spec: Any) -> tuple[int, int]:
    """How many channels are colours, and which is alpha, -1 for none."""
    try:
        names = [name.upper() for name in spec.channelnames]
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: damaged (its channels have no readable names); get the whole file again") from error
    alpha_index = names.index("A") if "A" in names else -1
    color_count = 3 if spec.nchannels - (alpha_index >= 0) >= 3 else 1
    if alpha_index >= 0 and alpha_index < color_count:
        raise InputError(f"{path}: channels {spec.channelnames} are neither grey nor RGB; convert it to RGB")
    return color_count, alpha_index


def _open(path: Path) -> Any:
    require_file(path)
    if "raw" not in READABLE_FORMATS and (raw := raw_kind(path)) is not None:
        raise InputError(f"{path}: is {raw.name}; {raw.way_out}")
    if path.suffix.lower() in PNG_ENDINGS:
        require_whole_png(path)
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(oiio_name(path), hints)
    if source is None:
        complaint = complaint_of(oiio)
        if (kind := unreadable_kind(path)) is not None:
            raise InputError(f"{path}: is {kind.name}; {kind.way_out}")
        if NO_READER in complaint:
            raise InputError(f"{path}: cannot be read as a picture (of no known kind); save it as JPEG, PNG or TIFF")
        raise InputError(f"{path}: cannot be read as a picture ({_reason(complaint, path)})")
    if source.format_name() == "ico":
        _seek_largest(source)
    spec = source.spec()
    if spec.width * spec.height > MAX_FILE_PIXELS:
        raise InputError(f"{path}: {spec.width}x{spec.height} exceed {MAX_FILE_PIXELS:,} pixels; make it smaller")
    if spec.width < 1 or spec.height < 1 or spec.depth > 1 or spec.deep:
        raise InputError(f"{path}: {spec.width}x{spec.height}x{spec.depth} is no flat picture")
    refuse_bomb(path, spec.image_bytes())
    return source


def _seek_largest(source: Any) -> None:
    """Go to the largest picture of an icon."""
    sizes: list[int] = []
    while len(sizes) < MAX_ICON_PICTURES and source.seek_subimage(len(sizes), 0):
        sizes.append(source.spec().width * source.spec().height)
    complaint_of(source)
    source.seek_subimage(sizes.index(max(sizes)), 0)


def require_whole_png(path: Path) -> None:
    """Raise InputError where a PNG lacks its end, found by walking its chunks, or claims an absurd size.

    libpng reports such files on stderr, where it would spoil our one line, and a disk that is full not at all.
    """
    with open_binary(path) as file:
        end = path.stat().st_size
        start = file.read(len(PNG_START))
        if start != PNG_START[: len(start)]:
            return  # something else under that name: the decoders find out
        header = file.read(16)
        width, height = (int.from_bytes(header[at : at + 4], "big") for at in (8, 12))
        if not (1 <= width <= MOST_PNG_SIDE and 1 <= height <= MOST_PNG_SIDE):
            raise InputError(
                f"{path}: damaged or cut off (it claims {width}x{height} pixels); get the whole file again"
            )
        file.seek(len(PNG_START))
        kind = b""
        while kind != b"IEND":
            header = file.read(8)
            kind = header[4:]
            if file.seek(int.from_bytes(header[:4], "big") + 4, 1) > end or len(header) < 8:
                raise InputError(f"{path}: damaged or cut off (it ends at byte {end}); get the whole file again")


def full_scale(dtype: Any) -> int:
    """The value of pixels of this type that is white, or opaque."""
    return np.iinfo(dtype).max if dtype.kind == "u" else 1


def _spec_of_whole_numbers(spec: Any) -> Any:
    """Return the header of a picture, with 16 bits for floating-point numbers that are encoded (JPEG XL), not light."""
    codes = spec.getattribute("CICP")
    if str(spec.format) in FLOATING_TYPES and isinstance(codes, tuple) and codes[1] not in LINEAR_TRANSFERS:
        spec.set_format("uint16")
    return spec


def _reading_type(stored: Any) -> str:
    if str(stored) in FLOATING_TYPES:
        return "float"
    return "uint8" if stored.size() == 1 else "uint16"


def text_attribute(spec: Any, name: str) -> str:
    """A text of a picture's header; "" where there is none, or one that is damaged."""
    try:
        return str(spec.get_string_attribute(name))
    except UnicodeDecodeError:
        return ""


def _reason(complaint: str, path: Path) -> str:
    """What of a complaint is to be told: some of its writers repeat the file's name."""
    return reason_of(re.sub(rf' \("?{re.escape(str(path))}"?\)', "", complaint))


def complaint_of(teller: Any) -> str:
    """What OpenImageIO, or one of its files, complains of, "" of nothing; it may quote bytes that are no text."""
    try:
        return str(teller.geterror())
    except UnicodeDecodeError:
        return "a name in it is no text"
