"""Depth maps behind photos that no XMP describes: Samsung's, Huawei's, and plain second JPEGs.

No maker publishes these layouts; they are as ExifTool's authors and users of such files found them. Distances are
unknown: the maps are relative.
"""

from __future__ import annotations

import re
import struct
from io import BytesIO
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iibr_core.depth.embedded.images import GREY_TOLERANCE, decode_map
from iibr_core.depth.embedded.jpeg import HEADER_BYTES, appended_pictures
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.formats.images.pillow_reader import DECODE_ERRORS
from iibr_core.formats.maps.disparity_file import has_shape_of
from iibr_core.types import FloatImage, ImageSize, InputError

SAMSUNG_MAP, SAMSUNG_SIZE = b"DualShot_DepthMap_1", b"DualShot_Extra_Info"
"""Names of the block with a map, and of the block with its size."""
SIZE = re.compile(rb"(?s)(?:.{4}){8,23}?[\x01-\x09]\x00\xff\xff(.{4})(.{4})")
"""Width and height, after a mark at a multiple of 4 in bytes 32 to 95."""
SAMSUNG_IN_FOCUS = b"DualShot_1"
MIN_SAME_LIKENESS, MIN_SHARPNESS_RATIO = 0.9, 1.02
"""Smallest likeness of the sharp picture to the blurred photo, and how much sharper it is at a small size."""
HUAWEI_HEADER = re.compile(rb"(?s)edof(?=(.{68}))")
OTHER_USE = re.compile(rb"http://ns.adobe.com/xap/|urn:iso:std:iso:ts:21496|hdrgm:|GainMap", re.IGNORECASE)
"""Marks of gain maps, mattes and other described pictures in their headers."""


def samsung_estimate(data: bytes) -> DepthEstimate | None:
    """Return the map of a photo with "Live focus", dark near; None without, or if its layout is unknown.

    Raises InputError if the trailer names a map that it does not hold.
    """
    blocks = _samsung_blocks(data)
    depth_map, size = blocks.get(SAMSUNG_MAP), SIZE.match(blocks.get(SAMSUNG_SIZE, b""))
    if depth_map is None or size is None:
        return None
    width, height = (int.from_bytes(side, "little") for side in size.groups())
    if not depth_map or width * height != len(depth_map):
        raise InputError(f"Samsung's depth map of {width}x{height} pixels holds {len(depth_map):,} bytes")
    return DepthEstimate(1 - _map_of(depth_map, width), "inverse depth")


def samsung_in_focus(data: bytes) -> bytes | None:
    """Return the file of the picture before the phone blurred it, None without."""
    return _samsung_blocks(data).get(SAMSUNG_IN_FOCUS)


def second_in_focus(data: bytes, end: int) -> bytes | None:
    """Return a JPEG behind a photo, which ends at `end`, that shows the same, sharper and no smaller; None without."""
    photo = thumbnail_of(data)
    if photo is None:
        return None
    for picture, _ in appended_pictures(data, end):
        found = None if OTHER_USE.search(picture[:HEADER_BYTES]) else thumbnail_of(picture)
        if found is None or not has_shape_of(found.size, photo.size) or found.size.width < photo.size.width:
            continue
        if _likeness(found, photo) >= MIN_SAME_LIKENESS and found.sharpness > MIN_SHARPNESS_RATIO * photo.sharpness:
            return picture
    return None


def huawei_estimate(data: bytes, end: int) -> DepthEstimate | None:
    """Return the map of a photo with "wide aperture" behind a JPEG that ends at `end`, None without.

    A header holds the phone's orientation, width and height; a byte for each pixel follows.
    """
    for mark in HUAWEI_HEADER.finditer(data, end):
        width, height = struct.unpack_from("<HH", mark[1], 16)
        content = data[mark.end(1) : mark.end(1) + width * height]
        # Other data may hold the mark's letters, too.
        if min(width, height) >= 16 and len(content) == width * height:
            stored = _map_of(content, width)
            # The first phones wrote 0 and always mirrored the map.
            turned = {0x10: stored[::-1], 0x11: stored[::-1, ::-1].T, 0x13: stored.T}.get(mark[1][7], stored[:, ::-1])
            return DepthEstimate(turned, "inverse depth")
    return None


def second_picture_estimate(data: bytes, end: int) -> DepthEstimate | None:
    """Return a grey picture of the photo's shape behind a JPEG that ends at `end`, if it is no copy of the photo.

    None without, if it cannot be read, or if the photo has a gain map.
    """
    if data.find(b"GainMap", 0, end) >= 0:
        return None
    for picture, _ in appended_pictures(data, end):
        if not OTHER_USE.search(picture[:HEADER_BYTES]) and _is_map(picture, data):
            try:
                return DepthEstimate(decode_map(picture, "the picture behind the photo"), "inverse depth")
            except InputError:
                continue
    return None


class Thumbnail(NamedTuple):
    """A small copy of a picture. size: of the picture itself; colors: (192, 256, 3), of 255."""

    size: ImageSize
    colors: NDArray[np.int16]

    @property
    def sharpness(self) -> float:
        """Mean step from pixel to pixel."""
        return float(np.abs(np.diff(self.colors, axis=1)).mean())

    @property
    def is_grey(self) -> bool:
        """Return whether nearly all of the pixels are grey."""
        return bool((np.ptp(self.colors, axis=2) > GREY_TOLERANCE).mean() <= 0.01)


def thumbnail_of(data: bytes) -> Thumbnail | None:
    """Return a small copy of a JPEG's bytes; None if they cannot be read."""
    try:
        with Image.open(BytesIO(data), formats=("JPEG",)) as picture:
            size = ImageSize(picture.height, picture.width)
            picture.draft("RGB", (512, 384))
            small = picture.convert("RGB").resize((256, 192), Image.Resampling.BOX)
            return Thumbnail(size, np.asarray(small, np.int16))
    except DECODE_ERRORS:
        return None


def _is_map(picture: bytes, photo: bytes) -> bool:
    """Return whether a picture is grey, has the photo's shape, and is neither a copy of it nor textured nor a matte."""
    small, photo_small = thumbnail_of(picture), thumbnail_of(photo)
    if small is None or photo_small is None or not small.is_grey or not has_shape_of(small.size, photo_small.size):
        return False
    grey = small.colors[..., 0]
    steps = np.maximum(np.abs(np.diff(grey, axis=0))[:, 1:], np.abs(np.diff(grey, axis=1))[1:])
    levels = np.bincount(grey.ravel() // 4)
    is_textured, is_matte = (steps > 3).mean() > 0.35, (levels > grey.size / 200).sum() < 8
    return not is_textured and not is_matte and abs(_likeness(small, photo_small)) <= 0.97


def _likeness(first: Thumbnail, second: Thumbnail) -> float:
    """Return the correlation of the brightness of two pictures in squares, 0 if one has none."""
    blocks = (found.colors.mean(axis=2).reshape(24, 8, 32, 8).mean(axis=(1, 3)).ravel() for found in (first, second))
    with np.errstate(invalid="ignore"):  # a photo of one colour has no copy
        return float(np.nan_to_num(np.corrcoef(*blocks)[0, 1]))


def _map_of(content: bytes, width: int) -> FloatImage:
    return np.frombuffer(content, np.uint8).reshape(-1, width).astype(np.float32) / np.float32(255)


def _samsung_blocks(data: bytes) -> dict[bytes, bytes]:
    """Return the blocks of Samsung's trailer ("SEFT") by name; none without."""
    end = len(data) - 2 if data.endswith(b"QDIOBS") else len(data)
    while end >= 8 and data[end - 4 : end].isalnum():  # blocks lie end to end, their lengths behind them
        length = int.from_bytes(data[end - 8 : end - 4], "little")
        if not 4 <= length < min(HEADER_BYTES, end - 8):
            break
        start = end - 8 - length
        if data[end - 4 : end] == b"SEFT":
            return _listed_blocks(data, start, length)
        end = start
    return {}


def _listed_blocks(data: bytes, start: int, length: int) -> dict[bytes, bytes]:
    """Return the blocks that the directory at `start` lists: distance from the directory, and size."""
    directory = data[start : start + length]
    if not directory.startswith(b"SEFH") or length < 12:
        return {}
    count = int.from_bytes(directory[8:12], "little")
    blocks: dict[bytes, bytes] = {}
    for at in range(12, min(12 + 12 * count, length - 11), 12):
        back, size = struct.unpack("<4xII", directory[at : at + 12])
        if back > start or not 8 <= size <= back:
            break
        block = data[start - back : start - back + size]
        name_end = 8 + int.from_bytes(block[4:8], "little")
        blocks.setdefault(block[8:name_end], block[name_end:])
    return blocks
