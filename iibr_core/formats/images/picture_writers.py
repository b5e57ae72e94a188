"""Pictures that people keep: in the kind of file, with the bits, the colours and the words that they asked for.

Each is written whole or not at all, with its colour profile; see `picture_kinds` for what there is.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Iterator
from io import BytesIO
from itertools import accumulate
from pathlib import Path
from pkgutil import resolve_name
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import ROWS_AT_ONCE, bytes_from_encoded, linear_from_srgb, srgb_from_linear
from iibr_core.formats.files import reason_of
from iibr_core.formats.images.icc_profile import icc_profile
from iibr_core.formats.images.metadata import PictureMetadata, exif_for, xmp_for
from iibr_core.formats.images.oiio_writer import PNG_SETTINGS, encode_image_file
from iibr_core.formats.images.picture_kinds import AS_USUAL, PictureFormat, picture_kind, require_picture_format
from iibr_core.formats.outputs import write_file
from iibr_core.types import SRGB, ColorSpace, InputError, image_size

PNG_START_BYTES = 8
PNG_KEPT = frozenset({b"IHDR", b"tEXt", b"zTXt", b"iTXt", b"IDAT", b"IEND"})
FINE_COLOR_QUALITY = 90
"""From here on JPEGs keep colour as finely as light."""
EXIF_START = b"Exif\0\0"
"""Of a record in a JPEG; a TIFF follows, with its numbers' high bytes first."""
TIFF_DEFLATE, TIFF_RGB, TIFF_DIFFERENCES, TIFF_LEVEL = 8, 2, 2, 4
WHITE_D65_XY = (0.3127, 0.3290)
PRIMARIES_XY = {
    "sRGB": (0.64, 0.33, 0.30, 0.60, 0.15, 0.06),
    "Display P3": (0.68, 0.32, 0.265, 0.69, 0.15, 0.06),
}
EXR_CAMERA = {
    0x829A: "ExposureTime",
    0x829D: "FNumber",
    0x8827: "Exif:PhotographicSensitivity",
    0x9003: "Exif:DateTimeOriginal",
    0x920A: "Exif:FocalLength",
    0xA405: "Exif:FocalLengthIn35mmFilm",
    0xA434: "Exif:LensModel",
}
EXR_PHOTO = {0x010E: "ImageDescription", 0x010F: "Make", 0x0110: "Model", 0x013B: "Artist", 0x8298: "Copyright"}


class _Encoded(NamedTuple):
    """A picture ready for its file. pixels: as they are stored. exif: Pillow's record of what goes on."""

    pixels: NDArray[Any]
    color_space: ColorSpace
    quality: int
    exif: Any
    metadata: PictureMetadata

    @property
    def icc(self) -> bytes:
        return icc_profile(self.color_space)

    @property
    def exif_bytes(self) -> bytes:
        return bytes(self.exif.tobytes()) if len(self.exif) else b""

    @property
    def xmp(self) -> bytes:
        return xmp_for(self.metadata.xmp, self.metadata.texts)


def write_picture(
    path: Path,
    pixels: NDArray[Any],
    form: PictureFormat = AS_USUAL,
    metadata: PictureMetadata | None = None,
    color_space: ColorSpace = SRGB,
) -> None:
    """Write pixels (H, W, 3), uint8, encoded by sRGB's curve, or float32 linear light, 1 = white, of color_space.

    metadata: of the photo that it was made of; what goes on from it, `metadata` says. Raises InputError for other
    endings, formats that the kind does not have, and where it cannot be written.
    """
    path, size, metadata = Path(path), image_size(pixels), metadata or PictureMetadata()
    require_picture_format(path, form, size)
    kind = picture_kind(path)
    stored = _stored(pixels, form.bits_for(path), kind.is_linear)
    exif = exif_for(metadata.exif, size, color_space, form.keeps_position)
    encoded = _Encoded(stored, color_space, form.quality, exif, metadata)
    with write_file(path) as temporary:
        try:
            resolve_name(f"{__name__}:{kind.write}")(temporary, encoded)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error
        except (ValueError, RuntimeError, struct.error, MemoryError) as error:
            raise InputError(f"{path}: cannot be written ({reason_of(error)}); choose another kind of file") from error


def write_png(path: Path, picture: _Encoded) -> None:
    """By OpenImageIO; what describes it goes before the pixels, where every reader looks."""
    encode_image_file(path, picture.pixels, str(picture.pixels.dtype), {**PNG_SETTINGS, **picture.metadata.texts})
    described = _png_chunk(b"iCCP", b"ICC profile\0\0" + zlib.compress(picture.icc))
    if picture.exif_bytes:
        described += _png_chunk(b"eXIf", picture.exif_bytes[len(EXIF_START) :])
    if xmp := xmp_for(picture.metadata.xmp, {}):
        described += _png_chunk(b"iTXt", b"XML:com.adobe.xmp\0\0\0\0\0" + xmp)
    chunks = list(_png_chunks(path.read_bytes()))
    path.write_bytes(b"".join((chunks[0], described, *chunks[1:])))


def write_exr(path: Path, picture: _Encoded) -> None:
    """Linear light, beyond white and below 0 too; its colours are said by their chromaticities."""
    values: dict[str, Any] = dict(picture.metadata.texts)
    xy = PRIMARIES_XY.get(picture.color_space.name)
    if xy is not None:
        values["chromaticities"] = (*xy, *WHITE_D65_XY)
    for names, folder in ((EXR_PHOTO, picture.exif), (EXR_CAMERA, picture.exif.get_ifd(0x8769))):
        values |= {name: _plain(folder[tag]) for tag, name in names.items() if _plain(folder.get(tag)) is not None}
    if xmp := xmp_for(picture.metadata.xmp, {}):
        values["xmp"] = xmp.decode()
    encode_image_file(path, picture.pixels, "half" if picture.pixels.dtype == np.float16 else "float", values)


def write_jpeg(path: Path, picture: _Encoded) -> None:
    """By Pillow."""
    fine = picture.quality >= FINE_COLOR_QUALITY
    _write_by_pillow(path, picture, "JPEG", optimize=True, subsampling="4:4:4" if fine else "4:2:0")


def write_webp(path: Path, picture: _Encoded) -> None:
    """By Pillow, without loss at the best quality."""
    _write_by_pillow(path, picture, "WEBP", lossless=picture.quality == 100, method=4)


def write_avif(path: Path, picture: _Encoded) -> None:
    """By Pillow."""
    fine = picture.quality >= FINE_COLOR_QUALITY
    _write_by_pillow(path, picture, "AVIF", subsampling="4:4:4" if fine else "4:2:0")


def write_tiff(path: Path, picture: _Encoded) -> None:
    """An Exif record is a TIFF's folder; rows packed by deflate follow it."""
    height, width, channels = picture.pixels.shape
    bits = 8 * picture.pixels.dtype.itemsize
    folder = picture.exif
    folder.update({0x100: width, 0x101: height, 0x102: (bits,) * channels, 0x103: TIFF_DEFLATE, 0x106: TIFF_RGB})
    folder.update({0x115: channels, 0x116: ROWS_AT_ONCE, 0x11C: 1, 0x13D: TIFF_DIFFERENCES, 0x8773: picture.icc})
    if picture.xmp:
        folder[0x2BC] = picture.xmp
    strips = list(_tiff_strips(picture.pixels))
    counts = [len(strip) for strip in strips]
    # Pillow counts them from the end of what it writes.
    folder.update({0x111: (0, *accumulate(counts[:-1])), 0x117: tuple(counts)})
    with path.open("wb") as file:
        file.write(folder.tobytes()[len(EXIF_START) :])
        file.writelines(strips)


def _stored(pixels: NDArray[Any], bits: int, is_linear: bool) -> NDArray[Any]:
    """The same as numbers of the file; a few rows at a time, as what comes between takes some times their memory."""
    if pixels.dtype == np.uint8 and bits == 8:
        return np.ascontiguousarray(pixels)
    kinds: dict[tuple[int, bool], type] = {(16, True): np.float16, (32, True): np.float32, (16, False): np.uint16}
    result: NDArray[Any] = np.empty(pixels.shape, kinds.get((bits, is_linear), np.uint8))
    for first in range(0, len(pixels), ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE)
        result[rows] = (_light if is_linear else _encoded)(pixels[rows], result.dtype)
    return result


def _light(pixels: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    light = linear_from_srgb(pixels / np.float32(255)) if pixels.dtype == np.uint8 else np.nan_to_num(pixels)
    most = float(np.finfo(dtype).max)
    return np.asarray(np.clip(light, -most, most))


def _encoded(pixels: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    if pixels.dtype == np.uint8:
        return pixels.astype(np.uint16) * np.uint16(257)
    encoded = srgb_from_linear(np.clip(np.nan_to_num(pixels), 0, 1))
    return bytes_from_encoded(encoded) if dtype == np.uint8 else np.asarray(encoded * 65535 + 0.5)


def _write_by_pillow(path: Path, picture: _Encoded, name: str, **options: Any) -> None:
    from PIL import Image

    if picture.exif_bytes:
        options["exif"] = picture.exif_bytes
    if picture.xmp:
        options["xmp"] = picture.xmp
    # In memory first: a disk that fills up is told by nothing but Python's own files.
    packed = BytesIO()
    Image.fromarray(picture.pixels).save(packed, name, quality=picture.quality, icc_profile=picture.icc, **options)
    path.write_bytes(packed.getbuffer())


def _plain(value: Any) -> str | float | None:
    """What an EXR's header holds of an Exif value; None for what it does not."""
    if isinstance(value, str):
        return value
    try:
        number = float(value[0] if isinstance(value, tuple) else value)
    except (TypeError, ValueError, ZeroDivisionError, IndexError):
        return None
    return number if math.isfinite(number) else None


def _png_chunks(data: bytes) -> Iterator[bytes]:
    """Those of a PNG that hold its pixels and texts, the first with the file's signature."""
    at, start = PNG_START_BYTES, data[:PNG_START_BYTES]
    while at < len(data):
        size = 12 + int.from_bytes(data[at : at + 4], "big")
        if data[at + 4 : at + 8] in PNG_KEPT:
            yield start + data[at : at + size]
            start = b""
        at += size


def _png_chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def _tiff_strips(pixels: NDArray[Any]) -> Iterator[bytes]:
    """ROWS_AT_ONCE rows each, as differences from pixel to pixel (TIFF 6.0, section 14)."""
    for first in range(0, len(pixels), ROWS_AT_ONCE):
        rows = pixels[first : first + ROWS_AT_ONCE]
        differences = rows.copy()
        differences[:, 1:] -= rows[:, :-1]
        yield zlib.compress(differences.astype(differences.dtype.newbyteorder(">")).tobytes(), TIFF_LEVEL)
