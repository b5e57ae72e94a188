"""HEIC photos (HEIF with HEVC), which OpenImageIO's wheel does not read."""

import struct
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import MAX_FILE_PIXELS, PARSE_ERRORS, SAVE_ELSEWHERE, read_bytes, require_file
from iibr_core.formats.images.iso_boxes import boxes, meta_boxes, with_primary
from iibr_core.formats.images.picture import Picture, opaque_as_none, require_sound_size, turned_size
from iibr_core.formats.images.pillow_reader import damage_as_input_error, exif_of, facts_of, orientation_in
from iibr_core.types import FloatImage, ImageSize, InputError, image_size

GROUP_HEADER_BYTES = 12
"""Size of a group's version, number and count, which precede the numbers of its items."""


def read_heic(path: Path, number: int = 0) -> Picture:
    """Decode a HEIC's photo, which libheif turns upright, or the picture of another number, see `heic_pair`."""
    picture = _open(path, number)
    pixels = _pixels(path, picture)
    alpha = opaque_as_none(pixels[..., 3]) if pixels.shape[2] == 4 else None
    is_premultiplied = bool(getattr(picture, "premultiplied_alpha", False))
    colors = pixels[..., : 3 if pixels.shape[2] >= 3 else 1]
    # Exif states the size that the camera stored, before the picture is turned.
    stored = turned_size(image_size(pixels), orientation_in(exif_of(picture.info.get("exif"))))
    return Picture(colors, alpha, is_premultiplied, **facts_of(picture.info, stored))


def heic_size(path: Path, number: int = 0) -> ImageSize:
    """Return the size of a HEIC's picture from its header."""
    width, height = _open(path, number).size
    return ImageSize(height, width)


def heic_pair(path: Path) -> tuple[int, int] | None:
    """Return the numbers of the left and the right eye's picture (ISO/IEC 23008-12, `ster`); None without such a group.

    A picture's number is that of its item; the photo itself has 0.
    """
    try:
        meta = meta_boxes(read_bytes(path))
        groups = [content for kind, content in boxes(meta.get(b"grpl", b"")) if kind == b"ster"]
        items = [item for (item,) in struct.iter_unpack(">I", groups[0][GROUP_HEADER_BYTES:])] if groups else []
        primary = int.from_bytes(meta[b"pitm"][4:], "big")
    except PARSE_ERRORS:
        return None  # the decoder of the photo reports the damage
    if not groups:
        return None
    if len(items) != 2 or items[0] == items[1]:
        raise InputError(
            f"{path}: its pair is described in an unknown way (by pictures {items});"
            " save both eyes side by side, under a name that ends in '_2x1'"
        )
    left, right = (0 if item == primary else item for item in items)
    return left, right


def read_heic_depth(path: Path) -> tuple[FloatImage, dict[str, Any]] | None:
    """Return the depth map of a portrait photo, upright: (H, W), 0..1, and libheif's description of its range.

    None for other photos.
    """
    maps = _open(path).info.get("depth_images") or []
    if not maps:
        return None
    width, height = maps[0].size
    if width < 1 or height < 1 or width * height > MAX_FILE_PIXELS:
        raise InputError(f"{path}: its depth map of {width}x{height} pixels is too large")
    pixels = _pixels(path, maps[0])
    scale = np.float32(1 / np.iinfo(pixels.dtype).max)
    return np.ascontiguousarray(pixels[..., 0]) * scale, dict(maps[0].info.get("metadata") or {})


def heic_info(path: Path) -> dict[str, Any]:
    """Return pi-heif's description of a HEIC's photo."""
    return dict(_open(path).info)


def heic_orientation(path: Path) -> int:
    """Return Exif's Orientation, 1..8, of a HEIC; its photo is read upright."""
    return orientation_in(exif_of(heic_info(path).get("exif")))


def _open(path: Path, number: int = 0) -> Any:
    import pi_heif

    require_file(path)
    with damage_as_input_error(path):
        content = with_primary(read_bytes(path), number) if number else path
        file = pi_heif.open_heif(content, convert_hdr_to_8bit=False)
    if not len(file):
        raise InputError(f"{path}: holds no picture of a known codec; {SAVE_ELSEWHERE}")
    with damage_as_input_error(path):
        width, height = file.size
    require_sound_size(path, width, height, width * height * 4)
    return file


def _pixels(path: Path, picture: Any) -> NDArray[Any]:
    with damage_as_input_error(path):
        pixels = np.array(picture)  # a copy: its own array does not outlive the file
    return pixels.reshape(*pixels.shape[:2], -1)
