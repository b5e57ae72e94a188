"""Writers of picture files: OpenImageIO for PNG and EXR, Pillow for JPEG, WebP and AVIF, rows behind Exif for TIFF.

They write to a temporary name; their InputError states the reason without a name.
"""

import struct
import zlib
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from io import BytesIO
from itertools import accumulate
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray
from PIL import Image

from iibr_core.color import ROWS_AT_ONCE
from iibr_core.formats.files import reason_of
from iibr_core.formats.images.color_profile import PRIMARIES, icc_profile
from iibr_core.formats.images.decode import complaint_of, oiio_name
from iibr_core.formats.images.metadata import PictureMetadata, exif_for, number_of
from iibr_core.formats.images.picture_kinds import BEST_QUALITY, PNG_SETTINGS, PictureFormat
from iibr_core.formats.images.pillow_reader import EXIF_FOLDER
from iibr_core.formats.images.xmp import xmp_for
from iibr_core.remedies import FixableError, Remedy
from iibr_core.types import ColorSpace, image_size

FINE_COLOR_QUALITY = 90
"""Quality from which JPEG and AVIF keep colour as finely as light."""
PNG_START_BYTES = 8
PNG_END = b"\0\0\0\0IEND\xaeB`\x82"
PNG_KEPT = (b"IHDR", b"IDAT", b"IEND")
"""Chunks that stay of OpenImageIO's PNG; those about colours would contradict the profile."""
EXIF_START = b"Exif\0\0"
"""Start of an Exif record in a JPEG; a TIFF with big-endian numbers follows."""
TIFF_DEFLATE, TIFF_RGB, TIFF_DIFFERENCES, TIFF_LEVEL = 8, 2, 2, 4
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


@dataclass(frozen=True, eq=False)
class _Content:
    """Content of a picture file. pixels: as stored. exif: Pillow's record. texts: of this program, for EXR."""

    kind: str
    pixels: NDArray[Any]
    color_space: ColorSpace
    quality: int
    exif: Image.Exif
    xmp: bytes
    texts: Mapping[str, str]

    @property
    def exif_bytes(self) -> bytes:
        """Exif in the form of JPEG files, b"" without."""
        return bytes(self.exif.tobytes()) if len(self.exif) else b""


def write_content(
    path: Path,
    kind: str,
    pixels: NDArray[Any],
    form: PictureFormat,
    metadata: PictureMetadata | None,
    color_space: ColorSpace,
) -> None:
    """Write a picture of a kind by its name, with the parts of the photo's metadata that are kept."""
    metadata = metadata or PictureMetadata()
    exif = exif_for(metadata.exif, image_size(pixels), color_space, form.keeps_position)
    xmp = xmp_for(metadata.xmp, {} if kind == "OpenEXR" else metadata.texts)
    write = {"PNG": _write_png, "TIFF": _write_tiff, "OpenEXR": _write_exr}.get(kind, _write_by_pillow)
    write(path, _Content(kind, pixels, color_space, form.quality, exif, xmp, metadata.texts))


def write_by_oiio(
    path: Path, values: NDArray[Any], dtype: str, attributes: Mapping[str, Any], channels: tuple[str, ...] = ()
) -> None:
    """Write values (H, W, C), stored as `dtype` in OpenImageIO's words."""
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
        raise FixableError(f"cannot be written ({reason})", Remedy.PLACE)
    if not _is_whole(path, spec.height):
        raise FixableError("cannot be written whole (is the disk full?)", Remedy.PLACE)


def _is_whole(path: Path, height: int) -> bool:
    """Return whether a file has its end: OpenImageIO does not report a disk that fills up while it closes a file."""
    if path.suffix.lower() == ".png":
        return path.read_bytes().endswith(PNG_END)
    source = oiio.ImageInput.open(oiio_name(path))
    last_row = source and source.read_scanline(height - 1)
    complaint_of(source or oiio)  # or OpenImageIO prints it
    return last_row is not None


def _write_png(path: Path, picture: _Content) -> None:
    """Write by OpenImageIO, then insert profile, Exif and XMP before the pixels, where every reader looks."""
    write_by_oiio(path, picture.pixels, str(picture.pixels.dtype), PNG_SETTINGS)
    described = _png_chunk(b"iCCP", b"ICC profile\0\0" + zlib.compress(icc_profile(picture.color_space)))
    if picture.exif_bytes:
        described += _png_chunk(b"eXIf", picture.exif_bytes[len(EXIF_START) :])
    if picture.xmp:
        described += _png_chunk(b"iTXt", b"XML:com.adobe.xmp\0\0\0\0\0" + picture.xmp)
    data = path.read_bytes()
    header, *rest = _png_chunks(data)
    path.write_bytes(b"".join((data[:PNG_START_BYTES], header, described, *rest)))


def _png_chunks(data: bytes) -> Iterator[bytes]:
    """Yield the chunks in PNG_KEPT."""
    at = PNG_START_BYTES
    while at < len(data):
        size = 12 + int.from_bytes(data[at : at + 4], "big")
        if data[at + 4 : at + 8] in PNG_KEPT:
            yield data[at : at + size]
        at += size


def _png_chunk(kind: bytes, content: bytes) -> bytes:
    return struct.pack(">I", len(content)) + kind + content + struct.pack(">I", zlib.crc32(kind + content))


def _write_exr(path: Path, picture: _Content) -> None:
    """Write linear light, beyond white and below 0 too; chromaticities state its colours."""
    values: dict[str, Any] = dict(picture.texts)
    if (xy := dict(PRIMARIES.values()).get(picture.color_space.name)) is not None:
        values["chromaticities"] = xy
    for names, folder in ((EXR_PHOTO, picture.exif), (EXR_CAMERA, picture.exif.get_ifd(EXIF_FOLDER))):
        for tag, name in names.items():
            value = folder.get(tag)
            values[name] = value if isinstance(value, str) else number_of(value)
    if picture.xmp:
        values["xmp"] = picture.xmp.decode()
    known = {name: value for name, value in values.items() if value}
    write_by_oiio(path, picture.pixels, "half" if picture.pixels.dtype == np.float16 else "float", known)


def _write_by_pillow(path: Path, picture: _Content) -> None:
    name = picture.kind.upper()
    options: dict[str, Any] = {"exif": picture.exif_bytes} if picture.exif_bytes else {}
    if picture.xmp:
        options["xmp"] = picture.xmp
    if name == "WEBP":
        options |= {"lossless": picture.quality == BEST_QUALITY, "method": 4}
    else:
        is_fine = picture.quality >= FINE_COLOR_QUALITY
        options |= {"subsampling": "4:4:4" if is_fine else "4:2:0", "optimize": name == "JPEG"}
    # Python's own files report a full disk; encoders do not.
    packed, profile = BytesIO(), icc_profile(picture.color_space)
    Image.fromarray(picture.pixels).save(packed, name, quality=picture.quality, icc_profile=profile, **options)
    path.write_bytes(packed.getbuffer())


def _write_tiff(path: Path, picture: _Content) -> None:
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
