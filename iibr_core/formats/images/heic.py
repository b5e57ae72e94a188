"""HEIC photos (HEIF with HEVC), which OpenImageIO's wheel does not read; they come out as rasters like all others."""

from __future__ import annotations

import struct
from collections.abc import Mapping
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import OpenImageIO as oiio
from numpy.typing import NDArray

from iibr_core.formats.files import MAX_FILE_PIXELS, open_binary, reason_of, refuse_bomb, require_file
from iibr_core.formats.images.oiio_reader import Raster
from iibr_core.types import FloatImage, ImageSize, InputError

BRANDS = frozenset({b"heic", b"heix", b"heim", b"heis", b"hevc", b"hevx", b"mif1", b"msf1"})
EXIF_FOLDER, ORIENTATION_TAG = 0x8769, 0x0112
EXIF_NUMBERS = {
    0x920A: "Exif:FocalLength",
    0xA405: "Exif:FocalLengthIn35mmFilm",
    0xA20E: "Exif:FocalPlaneXResolution",
    0xA210: "Exif:FocalPlaneResolutionUnit",
    0xA002: "Exif:PixelXDimension",
}
COLOR_CODES = "color_primaries", "transfer_characteristics", "matrix_coefficients", "full_range_flag"
"""A HEIC's colours in numbers, in the order in which PNGs have them (`CICP`)."""
HDR_TRANSFERS = (16, 18)
"""PQ and HLG, by the numbers of ITU-T H.273."""
DECODE_ERRORS = (ValueError, OSError, RuntimeError, EOFError, SyntaxError, MemoryError, IndexError, struct.error)


@dataclass(frozen=True, eq=False)
class HeicDepth:
    """The depth map beside a HEIC's photo, upright: (H, W), 0..1, with what libheif tells of its range."""

    values: FloatImage
    metadata: dict[str, Any]


def is_heic(path: Path) -> bool:
    """Whether a file begins as HEIF files do, whatever its name. Raises InputError where it cannot be read."""
    with open_binary(path) as file:
        start = file.read(12)
    return start[4:8] == b"ftyp" and start[8:12] in BRANDS


def read_heic(path: Path, number: int = 0) -> Raster:
    """Decode a HEIC's photo, turned upright as the file asks; number: or another picture, see `heic_pair`.

    Raises InputError as `read_raster` does.
    """
    file = _open(path, number)
    spec = oiio.ImageSpec(file.size[0], file.size[1], 3, "uint8")
    describe(spec, file.info)
    pixels = _pixels(path, file)
    alpha = np.ascontiguousarray(pixels[..., 3]) if pixels.shape[2] == 4 else None
    if alpha is not None and (alpha == np.iinfo(alpha.dtype).max).all():
        alpha = None
    if not getattr(file, "premultiplied_alpha", False):
        spec.attribute("oiio:UnassociatedAlpha", 1)
    return Raster(pixels[..., :3] if pixels.shape[2] >= 3 else pixels[..., :1], alpha, spec)


def heic_size(path: Path, number: int = 0) -> ImageSize:
    """From a HEIC's header. Raises InputError as `read_heic` does."""
    width, height = _open(path, number).size
    return ImageSize(height, width)


def heic_pair(path: Path) -> tuple[int, int] | None:
    """The numbers of the left and the right eye's picture, None where the file has no such group (ISO/IEC 23008-12,
    `ster`). Numbers are the pictures' places in the file, but for the photo itself, which is 0, and the first, which
    has its place then. Raises InputError as `read_heic` does, and for a group of other pictures than two.
    """
    file = _open_file(path)
    try:
        groups = [group for group in file.info.get("entity_groups") or () if group.get("type") == "ster"]
    except DECODE_ERRORS as error:
        raise InputError(f"{path}: damaged or cut off ({reason_of(error)}); get the whole file again") from error
    if not groups:
        return None
    places = [place for place in groups[0].get("images") or () if isinstance(place, int)]
    if len(places) != 2 or places[0] == places[1] or not all(0 <= place < len(file) for place in places):
        raise InputError(f"{path}: its group of two pictures holds others; get the whole file again")
    left, right = (_swapped(place, file.primary_index) for place in places)
    return left, right


def _swapped(number: int, primary: int) -> int:
    """Place from number, or number from place: the photo itself is 0."""
    return {0: primary, primary: 0}.get(number, number)


def read_heic_depth(path: Path) -> HeicDepth | None:
    """The depth map of a portrait photo, None where it has none. Raises InputError where it is damaged."""
    maps = _open(path).info.get("depth_images") or []
    if not maps:
        return None
    width, height = maps[0].size
    if width < 1 or height < 1 or width * height > MAX_FILE_PIXELS:
        raise InputError(f"{path}: its depth map of {width}x{height} pixels is absurd")
    pixels = _pixels(path, maps[0])
    scale = np.float32(1 / np.iinfo(pixels.dtype).max)
    return HeicDepth(np.ascontiguousarray(pixels[..., 0]) * scale, dict(maps[0].info.get("metadata") or {}))


def heic_orientation(path: Path) -> int:
    """Return Exif's Orientation, 1..8, of a HEIC; its photo is read upright. Raises InputError as `read_heic` does."""
    from PIL import Image

    exif = Image.Exif()
    with suppress(*DECODE_ERRORS, TypeError):
        exif.load(_open(path).info.get("exif") or b"")
    orientation = exif.get(ORIENTATION_TAG, 1)
    return int(orientation) if orientation in range(1, 9) else 1


def heic_auxiliaries(path: Path) -> tuple[str, ...]:
    """Return the types of the auxiliary pictures of a HEIC, but depth and alpha.

    Raises InputError as `read_heic` does.
    """
    return tuple(str(kind) for kind in _open(path).info.get("aux") or {})


def _open_file(path: Path) -> Any:
    import pillow_heif

    require_file(path)
    try:
        return pillow_heif.open_heif(path, convert_hdr_to_8bit=False)
    except DECODE_ERRORS as error:
        raise InputError(f"{path}: cannot be read as a HEIC picture ({reason_of(error)})") from error


def _open(path: Path, number: int = 0) -> Any:
    file = _open_file(path)
    try:
        picture = file[_swapped(number, file.primary_index)] if number else file
        width, height = picture.size
    except DECODE_ERRORS as error:
        raise InputError(f"{path}: cannot be read as a HEIC picture ({reason_of(error)})") from error
    if width < 1 or height < 1 or width * height > MAX_FILE_PIXELS:
        raise InputError(f"{path}: {width}x{height} exceed {MAX_FILE_PIXELS:,} pixels; make it smaller")
    refuse_bomb(path, width * height * 4)
    return picture


def _pixels(path: Path, picture: Any) -> NDArray[Any]:
    try:
        pixels = np.array(picture)  # a copy: pillow-heif 1.0's own array does not outlive the file
    except DECODE_ERRORS as error:
        raise InputError(f"{path}: damaged or cut off ({reason_of(error)}); get the whole file again") from error
    return pixels.reshape(*pixels.shape[:2], -1)


def describe(spec: Any, info: Mapping[Any, Any]) -> None:
    """Put what `read_photo` asks for into a header: focal length and colour profile, of what Pillow calls info.

    A profile counts more than colours in numbers, but for the curves of HDR.
    """
    from PIL import Image

    exif = Image.Exif()
    try:
        exif.load(info.get("exif") or b"")
        tags = exif.get_ifd(EXIF_FOLDER)
        for tag, name in EXIF_NUMBERS.items():
            if tag in tags:
                spec.attribute(name, float(tags[tag]))
    except (*DECODE_ERRORS, TypeError, ZeroDivisionError, KeyError):
        pass  # a photo is one without its Exif too
    codes = info.get("nclx_profile") or {}
    profile, numbers = info.get("icc_profile"), tuple(int(codes.get(name, 0)) for name in COLOR_CODES)
    if codes and (not profile or numbers[1] in HDR_TRANSFERS):
        spec.attribute("CICP", "int[4]", numbers)
    elif profile:
        values = np.frombuffer(profile, np.uint8)
        spec.attribute("ICCProfile", oiio.TypeDesc(f"uint8[{len(values)}]"), values)
        spec.attribute("ICCProfile:profile_description", _profile_name(profile))


def _profile_name(profile: bytes) -> str:
    from io import BytesIO

    from PIL import ImageCms

    try:
        return ImageCms.getProfileDescription(ImageCms.ImageCmsProfile(BytesIO(profile))).strip()
    except (ImageCms.PyCMSError, *DECODE_ERRORS):
        return ""
