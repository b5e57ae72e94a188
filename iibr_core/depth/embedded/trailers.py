"""Depth maps behind JPEG photos that no XMP describes: Huawei's, and plain second JPEGs.

No maker publishes these layouts; they are as users of such files found them. The near end is not known for sure: white
counts as near until the photo decides.
"""

from __future__ import annotations

import re
import struct
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iibr_core.depth.embedded.images import DECODE_ERRORS, GREY_TOLERANCE, decode_map
from iibr_core.depth.embedded.jpeg import appended_pictures
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.formats.maps.disparity_file import has_shape_of
from iibr_core.types import ImageSize, InputError

HUAWEI_HEADER = re.compile(rb"(?s)edof(?=(.{68}))")
HUAWEI_SIDES = range(16, 8193)
"""Plausible sides of a map in pixels; other data may hold the letters of the mark, too."""
COMPARED, INSPECTED = (32, 24), (256, 192)
"""(width, height) at which a picture is compared with the photo, and at which its texture is measured."""
MAX_CORRELATION = 0.97
"""Correlation with the photo's brightness, or its negative, above which a grey picture is a copy of the photo."""
MAX_TEXTURED = 0.35
"""Largest share of pixels of a map whose neighbours differ by more than 3 of 255."""
MIN_LEVELS = 8
"""Smallest number of grey levels of a map that more than one of 200 pixels have; a matte has fewer."""
OTHER_USE = re.compile(rb"http://ns.adobe.com/xap/|urn:iso:std:iso:ts:21496|hdrgm:|GainMap", re.IGNORECASE)
"""Marks of gain maps, mattes and other described pictures in their headers."""
HEADER_BYTES = 0x10000


def huawei_estimate(data: bytes, end: int) -> DepthEstimate | None:
    """Return the map of a photo with "wide aperture" behind a JPEG that ends at `end`, None without.

    A header holds the phone's orientation, width and height; a byte for each pixel follows. Raises InputError if the
    map is cut off.
    """
    cut_off = ""
    for mark in HUAWEI_HEADER.finditer(data, end):
        width, height = struct.unpack_from("<HH", mark[1], 16)
        if width not in HUAWEI_SIDES or height not in HUAWEI_SIDES:
            continue
        content = data[mark.end(1) : mark.end(1) + width * height]
        if len(content) == width * height:
            stored = np.frombuffer(content, np.uint8).reshape(height, width)
            # The first phones wrote 0 and always mirrored the map.
            turned = {0x10: stored[::-1], 0x11: stored[::-1, ::-1].T, 0x13: stored.T}.get(mark[1][7], stored[:, ::-1])
            return DepthEstimate(turned.astype(np.float32) / np.float32(255), "inverse depth")
        cut_off = cut_off or f"{width}x{height} pixels is cut off after {len(content):,} bytes"
    if cut_off:
        raise InputError(f"Huawei's depth map of {cut_off}; get the whole file again")
    return None


def second_picture_estimate(data: bytes, end: int) -> DepthEstimate | None:
    """Return a grey picture of the photo's shape behind a JPEG that ends at `end`, if it is no copy of the photo.

    None without, if it cannot be read, or if the photo has a gain map.
    """
    if OTHER_USE.search(data, 0, min(end, HEADER_BYTES)) and b"GainMap" in data[:end]:
        return None
    for picture, _ in appended_pictures(data, end):
        if not OTHER_USE.search(picture[:HEADER_BYTES]) and _is_map(picture, data):
            try:
                return DepthEstimate(decode_map(picture, "the picture behind the photo"), "inverse depth")
            except InputError:
                continue
    return None


def size_and_kind(data: bytes) -> tuple[ImageSize, bool] | None:
    """Return the size of a JPEG's bytes, and whether it is grey; None if it cannot be read."""
    colors = _small(data, COMPARED)
    if colors is None:
        return None
    with Image.open(BytesIO(data)) as picture:
        is_grey = (np.ptp(colors, axis=2) > GREY_TOLERANCE).mean() <= 0.01
        return ImageSize(picture.height, picture.width), bool(is_grey)


def _is_map(picture: bytes, photo: bytes) -> bool:
    """Return whether a picture is grey, has the photo's shape, and is neither a copy of it nor textured nor a matte."""
    (size, is_grey), (photo_size, _) = (size_and_kind(data) or (None, False) for data in (picture, photo))
    if not is_grey or size is None or photo_size is None or not has_shape_of(size, photo_size):
        return False
    small, photo_small, fine = _small(picture, COMPARED), _small(photo, COMPARED), _small(picture, INSPECTED)
    if small is None or photo_small is None or fine is None or np.ptp(small) < 16:
        return False
    grey = fine[..., 0]
    steps = np.maximum(np.abs(np.diff(grey, axis=0))[:, 1:], np.abs(np.diff(grey, axis=1))[1:])
    levels = np.bincount(grey.ravel() // 4)
    if (steps > 3).mean() > MAX_TEXTURED or (levels > grey.size / 200).sum() < MIN_LEVELS:
        return False
    first, second = (colors.mean(axis=2).ravel() for colors in (small, photo_small))
    return bool(np.ptp(second) == 0 or abs(np.corrcoef(first, second)[0, 1]) <= MAX_CORRELATION)


def _small(data: bytes, size: tuple[int, int]) -> NDArray[np.int16] | None:
    """Return the colours of a JPEG's bytes at a (width, height); None if they cannot be read."""
    try:
        with Image.open(BytesIO(data), formats=("JPEG",)) as picture:
            picture.draft("RGB", (2 * size[0], 2 * size[1]))
            return np.asarray(picture.convert("RGB").resize(size, Image.Resampling.BOX), np.int16)
    except DECODE_ERRORS:
        return None
