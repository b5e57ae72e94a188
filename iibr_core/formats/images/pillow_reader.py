"""Decodes with Pillow the kinds of pictures that OpenImageIO's wheel does not read."""

from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image

from iibr_core.formats.files import MAX_FILE_PIXELS, PARSE_ERRORS, decoding_fault, reason_of
from iibr_core.formats.images.hdr import HLG, PQ
from iibr_core.formats.images.picture import EXIF_NUMBERS, Picture, exif_focal_px, opaque_as_none, require_sound_size
from iibr_core.types import ImageSize, InputError

# Pillow's own limit is lower than ours: Exif of larger photos would be lost.
Image.MAX_IMAGE_PIXELS = MAX_FILE_PIXELS

EXIF_FOLDER, ORIENTATION_TAG = 0x8769, 0x0112
COLOR_CODES = "color_primaries", "transfer_characteristics", "matrix_coefficients", "full_range_flag"
"""Keys of Pillow's `nclx_profile`, in the order of `Picture.codes`."""
DECODE_ERRORS = (*PARSE_ERRORS, Image.DecompressionBombError)
"""Errors that Pillow and pi-heif raise for damaged files."""


@contextmanager
def open_with_pillow(path: Path, formats: tuple[str, ...], data: bytes | None = None) -> Iterator[Image.Image]:
    """Open a picture of one of these formats and read its header.

    data: bytes of a picture within the file, None for the file itself. Raises InputError where it is none, or claims
    an absurd size; also for Pillow's errors in the block.
    """
    try:
        image = Image.open(path if data is None else BytesIO(data), formats=formats)
    except DECODE_ERRORS as error:
        reason = reason_of(error).replace(f" {str(path)!r}", "")
        raise InputError(f"{path}: {decoding_fault(reason, is_opened=False)}") from error
    with image, damage_as_input_error(path):
        require_sound_size(path, image.width, image.height, image.width * image.height * 4)
        yield image


@contextmanager
def damage_as_input_error(path: Path) -> Iterator[None]:
    """Raise InputError for errors of Pillow and pi-heif in the block."""
    try:
        yield
    except InputError:
        raise
    except DECODE_ERRORS as error:
        raise InputError(f"{path}: {decoding_fault(error)}") from error


def picture_of(image: Image.Image) -> Picture:
    """Decode an opened picture in 8 bits, as stored. Raises Pillow's errors for damaged ones."""
    has_alpha = image.mode in ("RGBA", "LA", "PA")
    pixels = np.asarray(image.convert("RGBA" if has_alpha else "RGB"))
    alpha = opaque_as_none(pixels[..., 3]) if has_alpha else None
    facts = facts_of(image.info, ImageSize(image.height, image.width))
    return Picture(pixels[..., :3], alpha, orientation=orientation_in(image.getexif()), **facts)


def orientation_in(exif: Image.Exif) -> int:
    """Return the Orientation in Exif, 1 to 8."""
    orientation = exif.get(ORIENTATION_TAG, 1)
    return int(orientation) if orientation in range(1, 9) else 1


def exif_of(data: bytes | None) -> Image.Exif:
    """Return Exif in the form of JPEG files as Pillow's record; empty where it is missing or damaged."""
    exif = Image.Exif()
    with suppress(*DECODE_ERRORS):
        exif.load(data or b"")
    return exif


def facts_of(info: Mapping[Any, Any], size: ImageSize) -> dict[str, Any]:
    """Return focal length and colours for `Picture`, from what Pillow and pi-heif call info.

    A profile counts more than colours in numbers, except for the curves of HDR.
    """
    numbers = {}
    with suppress(*DECODE_ERRORS):  # a photo without Exif is a photo, too
        tags = exif_of(info.get("exif")).get_ifd(EXIF_FOLDER)
        numbers = {name: float(tags[tag]) for tag, name in EXIF_NUMBERS.items() if tag in tags}
    facts: dict[str, Any] = {"focal_px": exif_focal_px(numbers, size)}
    stated, profile = info.get("nclx_profile") or {}, info.get("icc_profile")
    codes = tuple(int(stated.get(name, 0)) for name in COLOR_CODES)
    if stated and (not profile or codes[1] in (PQ, HLG)):
        return facts | {"codes": codes}
    return facts | {"icc": bytes(profile or b"")}
