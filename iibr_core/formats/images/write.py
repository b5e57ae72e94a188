"""Writes pictures, whole or not at all: those that people keep (`write_picture`), and views and data (`write_image`).

Libraries are imported where they are needed: the kinds of files are asked for before anything is loaded.
"""

from __future__ import annotations

import math
import struct
import zlib
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import partial
from io import BytesIO
from itertools import accumulate
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import ROWS_AT_ONCE, bytes_from_encoded, linear_from_srgb, srgb_from_linear
from iibr_core.formats.files import reason_of
from iibr_core.formats.images.color_profile import icc_profile
from iibr_core.formats.outputs import write_file
from iibr_core.types import (
    DISPLAY_P3,
    SRGB,
    ColorSpace,
    ImageSize,
    InputError,
    image_size,
)

if TYPE_CHECKING:
    from iibr_core.formats.images.metadata import PictureMetadata

BEST_QUALITY = 100
FINE_COLOR_QUALITY = 90
"""Quality from which JPEG and AVIF keep colour as finely as light."""
PROFILES = {"srgb": SRGB, "p3": DISPLAY_P3}
"""Colour spaces of saved pictures by the names that people type."""
PRIMARIES_XY = {
    "sRGB": (0.64, 0.33, 0.30, 0.60, 0.15, 0.06, 0.3127, 0.3290),
    "Display P3": (0.68, 0.32, 0.265, 0.69, 0.15, 0.06, 0.3127, 0.3290),
}
"""Chromaticities of red, green, blue and white, by the name of the space."""
PNG_SETTINGS: Mapping[str, str | int | float] = {"png:compressionLevel": 1, "png:filter": 64}
"""Level 1 is 8 times faster than the default 6, 10 % larger; filter 64 is the average."""
PNG_START_BYTES = 8
PNG_END = b"\0\0\0\0IEND\xaeB`\x82"
PNG_KEPT = frozenset({b"IHDR", b"tEXt", b"zTXt", b"iTXt", b"IDAT", b"IEND"})
"""Chunks that stay of OpenImageIO's PNG; those about colours would contradict the profile."""
EXIF_START = b"Exif\0\0"
"""Start of an Exif record in a JPEG; a TIFF with big-endian numbers follows."""
TIFF_DEFLATE, TIFF_RGB, TIFF_DIFFERENCES, TIFF_LEVEL = 8, 2, 2, 4
EXIF_FOLDER = 0x8769
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
"""OpenImageIO's names of Exif tags that an OpenEXR file keeps: of the camera's folder, and of the first one."""


@dataclass(frozen=True)
class PictureKind:
    """A kind of picture files.

    bits: numbers of bits of a channel, the usual one first. has_quality: whether a lower quality makes smaller files.
    is_linear: whether it holds light, not values encoded by sRGB's curve. max_side_px: 0 where there is no limit.
    """

    name: str
    bits: tuple[int, ...]
    has_quality: bool = False
    is_linear: bool = False
    max_side_px: int = 0


_JPEG = PictureKind("JPEG", (8,), has_quality=True, max_side_px=65_500)
_TIFF = PictureKind("TIFF", (16, 8))
KINDS = {
    ".png": PictureKind("PNG", (8, 16)),
    ".jpg": _JPEG,
    ".jpeg": _JPEG,
    ".tif": _TIFF,
    ".tiff": _TIFF,
    ".exr": PictureKind("OpenEXR", (32, 16), is_linear=True),
    ".webp": PictureKind("WebP", (8,), has_quality=True, max_side_px=16_383),
    ".avif": PictureKind("AVIF", (8,), has_quality=True, max_side_px=65_536),
}
"""Kinds of saved pictures by the ending of the name."""


@dataclass(frozen=True)
class PictureFormat:
    """Options for writing a picture.

    bits: of a channel, None for the kind's usual number. quality: 1 to 100, for kinds that have it. color_space: None
    for the photo's, as far as Display P3 holds it. keeps_position: whether the place of the photo stays in the file.
    """

    bits: int | None = None
    quality: int = 95
    color_space: ColorSpace | None = None
    keeps_position: bool = False

    def space_for(self, photo: ColorSpace) -> ColorSpace:
        """Return the colour space in which a photo of the given space is saved."""
        return self.color_space or (SRGB if photo == SRGB else DISPLAY_P3)

    def bits_for(self, path: Path) -> int:
        """Return the bits of a channel for a file. Raises InputError where its kind is unknown or lacks them."""
        kind = picture_kind(path)
        bits = kind.bits[0] if self.bits is None else self.bits
        if bits not in kind.bits:
            known = " or ".join(map(str, sorted(kind.bits)))
            more = " (.png and .tif hold 16)" if bits == 16 else ""
            raise InputError(f"{path}: {kind.name} is written with {known} bits a channel, not {bits}{more}")
        return bits


AS_USUAL = PictureFormat()


@dataclass(frozen=True, eq=False)
class _Encoded:
    """A picture ready for its file.

    pixels: as stored. exif: Pillow's record. texts: of this program. xmp: packet with them; plain_xmp: packet without
    them, for kinds that keep them elsewhere.
    """

    pixels: NDArray[Any]
    color_space: ColorSpace
    quality: int
    exif: Any
    texts: Mapping[str, str]
    xmp: bytes
    plain_xmp: bytes

    @property
    def exif_bytes(self) -> bytes:
        """Exif as it stands in JPEG files, b"" without."""
        return bytes(self.exif.tobytes()) if len(self.exif) else b""


def picture_kind(path: Path) -> PictureKind:
    """Return the kind of a file by its ending. Raises InputError for unknown ones."""
    kind = KINDS.get(path.suffix.lower())
    if kind is None:
        raise InputError(f"{path}: can be written as {', '.join(KINDS)} only")
    return kind


def require_picture_format(path: Path, form: PictureFormat, size: ImageSize | None = None) -> None:
    """Raise InputError where a picture cannot be written with these options. size: None where it is not known yet."""
    form.bits_for(path)
    if not 1 <= form.quality <= BEST_QUALITY:
        raise InputError(f"quality {form.quality}: give 1 to {BEST_QUALITY}")
    most = picture_kind(path).max_side_px
    if size is not None and 0 < most < max(size):
        raise InputError(f"{path}: {size} px; {picture_kind(path).name} holds {most} a side: save it as .png or .tif")


def is_float(path: Path, form: PictureFormat = AS_USUAL) -> bool:
    """Return whether a file gets more than 8 bits a channel: linear light is drawn for it. Raises InputError."""
    return form.bits_for(path) > 8


def write_picture(
    path: Path,
    pixels: NDArray[Any],
    form: PictureFormat = AS_USUAL,
    metadata: PictureMetadata | None = None,
    color_space: ColorSpace = SRGB,
) -> None:
    """Write a picture that people keep, with its colour profile.

    pixels: (H, W, 3) of `color_space`, uint8 encoded by sRGB's curve, or float32 linear light, 1 = white. metadata: of
    the photo that it was made of; the module `metadata` states what is kept. Raises InputError for other endings,
    formats that the kind does not have, and where the file cannot be written.
    """
    from iibr_core.formats.images.metadata import PictureMetadata, exif_for, xmp_for

    path, size, metadata = Path(path), image_size(pixels), metadata or PictureMetadata()
    require_picture_format(path, form, size)
    kind = picture_kind(path)
    stored = _stored(pixels, form.bits_for(path), kind.is_linear)
    exif = exif_for(metadata.exif, size, color_space, form.keeps_position)
    xmp, plain_xmp = xmp_for(metadata.xmp, metadata.texts), xmp_for(metadata.xmp, {})
    encoded = _Encoded(stored, color_space, form.quality, exif, metadata.texts, xmp, plain_xmp)
    with write_file(path) as temporary:
        try:
            _WRITERS[kind.name](temporary, encoded)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error
        except (ValueError, RuntimeError, struct.error, MemoryError) as error:
            raise InputError(f"{path}: cannot be written ({reason_of(error)}); choose another kind of file") from error


def write_image(path: Path, pixels: NDArray[Any], metadata: Mapping[str, str | int | float] | None = None) -> None:
    """Write views and data: sRGB-encoded pixels (H, W) or (H, W, C), uint8, or floats with 1 = white.

    `.png` gets 8 bits, `.exr` linear light: half floats for uint8 and float16, else float32. Raises InputError for
    other endings and where the file cannot be written.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in (".png", ".exr"):
        raise InputError(f"{path}: can be written as .png or .exr only")
    stored = np.atleast_3d(pixels)
    if kind == ".png":
        stored, dtype = stored if stored.dtype == np.uint8 else bytes_from_encoded(np.nan_to_num(stored)), "uint8"
    else:
        dtype = "half" if stored.dtype in (np.uint8, np.float16) else "float"
        stored = linear_from_srgb(stored / np.float32(255) if stored.dtype == np.uint8 else stored)
        stored = np.minimum(stored, np.finfo(np.float16).max).astype(np.float16) if dtype == "half" else stored
    write_image_file(path, np.ascontiguousarray(stored), dtype, {**PNG_SETTINGS, **(metadata or {})})


def write_image_file(
    path: Path,
    values: NDArray[Any],
    dtype: str,
    attributes: Mapping[str, str | int | float] | None = None,
    channels: tuple[str, ...] = (),
) -> None:
    """Write values (H, W, C) by OpenImageIO, stored as `dtype` in its words ("uint8", "half", "float").

    attributes: of the file's header. channels: names of the channels, where they are not those of grey, RGB or RGBA.
    Raises InputError where the file cannot be written.
    """
    with write_file(path) as temporary:
        try:
            _write_by_oiio(temporary, values, dtype, attributes or {}, channels)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error


def _write_by_oiio(
    path: Path, values: NDArray[Any], dtype: str, attributes: Mapping[str, Any], channels: tuple[str, ...] = ()
) -> None:
    """Write values to a temporary place. Raises InputError without the file's name."""
    import OpenImageIO as oiio

    from iibr_core.formats.images.decode import complaint_of, oiio_name

    spec = oiio.ImageSpec(values.shape[1], values.shape[0], values.shape[2], dtype)
    for key, value in attributes.items():
        is_array = isinstance(value, tuple)
        spec.attribute(key, *([oiio.TypeDesc(f"float[{len(value)}]"), value] if is_array else [value]))
    if channels:
        spec.channelnames = channels
    name = oiio_name(path)
    target = oiio.ImageOutput.create(name)
    # Writing to an output that did not open crashes OpenImageIO.
    if target is None or not (target.open(name, spec) and target.write_image(values) and target.close()):
        reason = reason_of(complaint_of(oiio if target is None else target))
        raise InputError(f"cannot be written ({reason}); choose another place")
    if not _is_whole(path, spec.height):
        raise InputError("cannot be written whole (is the disk full?); choose another place")


def _is_whole(path: Path, height: int) -> bool:
    """Return whether a file has its end: OpenImageIO does not report a disk that fills up while it closes a file."""
    import OpenImageIO as oiio

    from iibr_core.formats.images.decode import complaint_of, oiio_name

    if path.suffix.lower() == ".png":
        return path.read_bytes()[-len(PNG_END) :] == PNG_END
    source = oiio.ImageInput.open(oiio_name(path))
    last_row = source and source.read_scanline(height - 1)
    complaint_of(source or oiio)  # or OpenImageIO prints it
    return last_row is not None


def _write_png(path: Path, picture: _Encoded) -> None:
    """Write by OpenImageIO, then insert profile, Exif and XMP before the pixels, where every reader looks."""
    _write_by_oiio(path, picture.pixels, str(picture.pixels.dtype), {**PNG_SETTINGS, **picture.texts})
    described = _png_chunk(b"iCCP", b"ICC profile\0\0" + zlib.compress(icc_profile(picture.color_space)))
    if picture.exif_bytes:
        described += _png_chunk(b"eXIf", picture.exif_bytes[len(EXIF_START) :])
    if picture.plain_xmp:
        described += _png_chunk(b"iTXt", b"XML:com.adobe.xmp\0\0\0\0\0" + picture.plain_xmp)
    chunks = list(_png_chunks(path.read_bytes()))
    path.write_bytes(b"".join((chunks[0], described, *chunks[1:])))


def _write_exr(path: Path, picture: _Encoded) -> None:
    """Write linear light, beyond white and below 0 too; chromaticities state its colours."""
    values: dict[str, Any] = dict(picture.texts)
    if picture.color_space.name in PRIMARIES_XY:
        values["chromaticities"] = PRIMARIES_XY[picture.color_space.name]
    for names, folder in ((EXR_PHOTO, picture.exif), (EXR_CAMERA, picture.exif.get_ifd(EXIF_FOLDER))):
        values |= {name: value for tag, name in names.items() if (value := _plain(folder.get(tag))) is not None}
    if picture.plain_xmp:
        values["xmp"] = picture.plain_xmp.decode()
    _write_by_oiio(path, picture.pixels, "half" if picture.pixels.dtype == np.float16 else "float", values)


def _write_by_pillow(path: Path, picture: _Encoded, name: str) -> None:
    from PIL import Image

    is_fine, profile = picture.quality >= FINE_COLOR_QUALITY, icc_profile(picture.color_space)
    options: dict[str, Any] = {"subsampling": "4:4:4" if is_fine else "4:2:0", "optimize": name == "JPEG"}
    if name == "WEBP":
        options = {"lossless": picture.quality == BEST_QUALITY, "method": 4}
    described = {"exif": picture.exif_bytes, "xmp": picture.xmp}
    options |= {key: value for key, value in described.items() if value}
    # Python's own files report a full disk; encoders do not.
    packed = BytesIO()
    Image.fromarray(picture.pixels).save(packed, name, quality=picture.quality, icc_profile=profile, **options)
    path.write_bytes(packed.getbuffer())


def _write_tiff(path: Path, picture: _Encoded) -> None:
    """Write an Exif record, which is a TIFF's folder, with rows packed by deflate behind it.

    OpenImageIO would lose sensitivity, title, rating and keywords; Pillow has no 16 bits.
    """
    height, width, channels = picture.pixels.shape
    bits = 8 * picture.pixels.dtype.itemsize
    folder = picture.exif
    folder.update({0x100: width, 0x101: height, 0x102: (bits,) * channels, 0x103: TIFF_DEFLATE, 0x106: TIFF_RGB})
    folder.update({0x115: channels, 0x116: ROWS_AT_ONCE, 0x11C: 1, 0x13D: TIFF_DIFFERENCES})
    folder[0x8773] = icc_profile(picture.color_space)
    if picture.xmp:
        folder[0x2BC] = picture.xmp
    strips = list(_tiff_strips(picture.pixels))
    counts = [len(strip) for strip in strips]
    # Pillow counts them from the end of the folder.
    folder.update({0x111: (0, *accumulate(counts[:-1])), 0x117: tuple(counts)})
    with path.open("wb") as file:
        file.write(folder.tobytes()[len(EXIF_START) :])
        file.writelines(strips)


def _tiff_strips(pixels: NDArray[Any]) -> Iterator[bytes]:
    """Yield ROWS_AT_ONCE rows at a time, as differences from pixel to pixel (TIFF 6.0, section 14)."""
    for first in range(0, len(pixels), ROWS_AT_ONCE):
        rows = pixels[first : first + ROWS_AT_ONCE]
        differences = rows.copy()
        differences[:, 1:] -= rows[:, :-1]
        yield zlib.compress(differences.astype(differences.dtype.newbyteorder(">")).tobytes(), TIFF_LEVEL)


_WRITERS: dict[str, Callable[[Path, _Encoded], None]] = {
    "PNG": _write_png,
    "TIFF": _write_tiff,
    "OpenEXR": _write_exr,
    "JPEG": partial(_write_by_pillow, name="JPEG"),
    "WebP": partial(_write_by_pillow, name="WEBP"),
    "AVIF": partial(_write_by_pillow, name="AVIF"),
}


def _stored(pixels: NDArray[Any], bits: int, is_linear: bool) -> NDArray[Any]:
    """Return pixels as numbers of the file; a few rows at a time, as steps between take more memory."""
    if pixels.dtype == np.uint8 and bits == 8:
        return np.ascontiguousarray(pixels)
    kinds: dict[tuple[int, bool], type] = {(16, True): np.float16, (32, True): np.float32, (16, False): np.uint16}
    result: NDArray[Any] = np.empty(pixels.shape, kinds.get((bits, is_linear), np.uint8))
    for first in range(0, len(pixels), ROWS_AT_ONCE):
        rows = slice(first, first + ROWS_AT_ONCE)
        result[rows] = (_light_of if is_linear else _codes_of)(pixels[rows], result.dtype)
    return result


def _light_of(pixels: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    light = linear_from_srgb(pixels / np.float32(255)) if pixels.dtype == np.uint8 else np.nan_to_num(pixels)
    most = float(np.finfo(dtype).max)
    return np.asarray(np.clip(light, -most, most))


def _codes_of(pixels: NDArray[Any], dtype: np.dtype[Any]) -> NDArray[Any]:
    if pixels.dtype == np.uint8:
        return pixels.astype(np.uint16) * np.uint16(257)
    encoded = srgb_from_linear(np.clip(np.nan_to_num(pixels), 0, 1))
    return bytes_from_encoded(encoded) if dtype == np.uint8 else np.asarray(encoded * 65535 + 0.5)


def _plain(value: Any) -> str | float | None:
    """Return an Exif value for the header of an EXR; None where it can hold none."""
    if isinstance(value, str):
        return value
    try:
        number = float(value[0] if isinstance(value, tuple) else value)
    except (TypeError, ValueError, ZeroDivisionError, IndexError):
        return None
    return number if math.isfinite(number) else None


def _png_chunks(data: bytes) -> Iterator[bytes]:
    """Yield the chunks in PNG_KEPT, the first one with the file's signature."""
    at, start = PNG_START_BYTES, data[:PNG_START_BYTES]
    while at < len(data):
        size = 12 + int.from_bytes(data[at : at + 4], "big")
        if data[at + 4 : at + 8] in PNG_KEPT:
            yield start + data[at : at + size]
            start = b""
        at += size


def _png_chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))
