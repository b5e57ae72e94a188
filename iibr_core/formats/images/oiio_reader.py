"""Decodes picture files, the one place that reads through OpenImageIO: refused by header before memory is spent, and
whole or an error.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from iibr_core.formats.files import MAX_FILE_PIXELS, open_binary, reason_of, refuse_bomb, require_file
from iibr_core.types import ImageSize, InputError

# Some cameras pad their JPEGs; the decoder complains and loses nothing.
HARMLESS_MESSAGE = "extraneous bytes"
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


def read_size(path: Path) -> ImageSize:
    """From a picture file's header. Raises InputError as `read_raster` does."""
    spec = _open(path).spec()
    return ImageSize(spec.height, spec.width)


def read_orientation(path: Path) -> int:
    """Exif's Orientation, 1..8, from a picture file's header; 1 where it tells none or cannot be read."""
    source = oiio.ImageInput.open(str(path))
    if source is None:
        complaint_of(oiio)
        return 1
    return int(source.spec().get_int_attribute("Orientation", 1))


def read_raster(path: Path) -> Raster:
    """Decode the first picture of a file, as it is stored: no colour conversion, no orientation.

    Alpha stays unmultiplied where the file has it so; palettes and CMYK come out as RGB. Raises InputError if the file
    is missing, no picture, cut off, or larger than MAX_FILE_PIXELS.
    """
    source = _open(path)
    spec = source.spec()
    try:
        names = [name.upper() for name in spec.channelnames]
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: damaged (its channels have no readable names); get the whole file again") from error
    alpha_index = names.index("A") if "A" in names else -1
    color_count = 3 if spec.nchannels - (alpha_index >= 0) >= 3 else 1
    if alpha_index >= 0 and alpha_index < color_count:
        raise InputError(f"{path}: channels {spec.channelnames} are neither grey nor RGB; convert it to RGB")
    pixels = source.read_image(0, 0, 0, max(color_count, alpha_index + 1), _reading_type(spec.format))
    message = complaint_of(source)
    if pixels is None or (message and HARMLESS_MESSAGE not in message):
        raise InputError(f"{path}: damaged or cut off ({reason_of(message)}); get the whole file again")
    alpha = np.ascontiguousarray(pixels[..., alpha_index]) if alpha_index >= 0 else None
    if alpha is not None and (alpha >= (np.iinfo(alpha.dtype).max if alpha.dtype.kind == "u" else 1)).all():
        alpha = None
    return Raster(pixels[..., :color_count], alpha, spec)


def _open(path: Path) -> Any:
    require_file(path)
    if path.suffix.lower() == ".png":
        require_whole_png(path)
    hints = oiio.ImageSpec()
    hints.attribute("oiio:UnassociatedAlpha", 1)
    source = oiio.ImageInput.open(str(path), hints)
    if source is None:
        raise InputError(f"{path}: cannot be read as a picture ({reason_of(complaint_of(oiio))})")
    spec = source.spec()
    if spec.width * spec.height > MAX_FILE_PIXELS:
        raise InputError(f"{path}: {spec.width}x{spec.height} exceed {MAX_FILE_PIXELS:,} pixels; make it smaller")
    if spec.width < 1 or spec.height < 1 or spec.depth > 1 or spec.deep:
        raise InputError(f"{path}: {spec.width}x{spec.height}x{spec.depth} is no flat picture")
    refuse_bomb(path, spec.image_bytes())
    return source


def require_whole_png(path: Path) -> None:
    """Raise InputError where a PNG lacks its end, found by walking its chunks.

    libpng reports a cut-off file on stderr, where it would spoil our one line, and a disk that is full not at all.
    """
    with open_binary(path) as file:
        end = path.stat().st_size
        start = file.read(len(PNG_START))
        if start != PNG_START[: len(start)]:
            return  # something else under that name: the decoders find out
        kind = b""
        while kind != b"IEND":
            header = file.read(8)
            kind = header[4:]
            if file.seek(int.from_bytes(header[:4], "big") + 4, 1) > end or len(header) < 8:
                raise InputError(f"{path}: damaged or cut off (it ends at byte {end}); get the whole file again")


def _reading_type(stored: Any) -> str:
    if str(stored) in ("half", "float", "double"):
        return "float"
    return "uint8" if stored.size() == 1 else "uint16"


def text_attribute(spec: Any, name: str) -> str:
    """A text of a picture's header; "" where there is none, or one that is damaged."""
    try:
        return str(spec.get_string_attribute(name))
    except UnicodeDecodeError:
        return ""


def complaint_of(teller: Any) -> str:
    """What OpenImageIO, or one of its files, complains of, "" of nothing; it may quote bytes that are no text."""
    try:
        return str(teller.geterror())
    except UnicodeDecodeError:
        return "a name in it is no text"
