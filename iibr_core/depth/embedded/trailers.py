"""Depth maps that phones append to their JPEG photos without describing them in XMP: Huawei's, and plain second JPEGs.

No maker publishes these layouts; they are as users of such files found them. Which end is near is not known for sure:
white is taken for near, and the photo decides.
"""

from __future__ import annotations

import re
import struct
from io import BytesIO

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from iibr_core.depth.embedded.images import DECODE_ERRORS, decode_map
from iibr_core.depth.embedded.xmp import jpeg_layout
from iibr_core.depth.estimate import DepthEstimate
from iibr_core.types import FloatImage, ImageSize, InputError

HUAWEI_MARK = re.compile(b"edof")
HUAWEI_ORIENTATION_AT, HUAWEI_SIZE_AT, HUAWEI_HEADER_BYTES = 7, 16, 68
"""Behind the mark: how the phone was held, width and height, two bytes each; then the map, a byte a pixel."""
HUAWEI_SIDES = range(16, 8193)
"""Sides of a map in pixels; the four letters of the mark stand in other data as well."""
MAX_PICTURES = 8
COMPARED, LOOKED_AT = (32, 24), (256, 192)
"""(width, height) at which a picture is compared with the photo, and at which its texture is looked at."""
MOST_LIKENESS = 0.97
"""Correlation with the photo's brightness, or its negative, from which a grey picture is a copy of it, not a map."""
TEXTURE_STEP, MOST_TEXTURED = 3, 0.35
"""A map is smooth inside surfaces: in no larger share of it do neighbours differ by more than this step of 255."""
LEAST_LEVELS = 8
"""A matte has fewer grey values that are seen in more than one of 200 pixels."""
OTHER_USE = re.compile(rb"http://ns.adobe.com/xap/|urn:iso:std:iso:ts:21496|hdrgm:|GainMap", re.IGNORECASE)
"""Pictures whose headers hold these are gain maps, mattes and others that say what they are."""
HEADER_BYTES = 0x10000
LEAST_RANGE = 16
"""Of 255, between the darkest and the brightest place of a map."""
GREY_TOLERANCE = 10
MAX_ASPECT_DIFFERENCE = 0.03


def huawei_estimate(data: bytes, end: int) -> DepthEstimate | None:
    """The map of a photo with "wide aperture"; None where a JPEG, which ends at `end`, is followed by none.

    Raises InputError where the map is cut off.
    """
    cut_off = ""
    for mark in HUAWEI_MARK.finditer(data, end):
        header = data[mark.end() : mark.end() + HUAWEI_HEADER_BYTES]
        if len(header) < HUAWEI_HEADER_BYTES:
            break
        width, height = struct.unpack_from("<HH", header, HUAWEI_SIZE_AT)
        start = mark.end() + HUAWEI_HEADER_BYTES
        content = data[start : start + width * height]
        if width in HUAWEI_SIDES and height in HUAWEI_SIDES and len(content) == width * height:
            stored = np.frombuffer(content, np.uint8).reshape(height, width)
            turned = _as_held(stored, header[HUAWEI_ORIENTATION_AT])
            return DepthEstimate(turned.astype(np.float32) / np.float32(255), "inverse depth")
        if width in HUAWEI_SIDES and height in HUAWEI_SIDES:
            cut_off = cut_off or f"{width}x{height} pixels is cut off after {len(content):,} bytes"
    if cut_off:
        raise InputError(f"Huawei's depth map of {cut_off}; get the whole file again")
    return None


def _as_held(stored: NDArray[np.uint8], orientation: int) -> NDArray[np.uint8]:
    """Return a Huawei map (h, w) as the photo is; the first phones wrote 0 and always mirrored it."""
    match orientation:
        case 0x10:
            return stored[::-1]
        case 0x11:
            return stored[::-1, ::-1].T
        case 0x13:
            return stored.T
        case _:
            return stored[:, ::-1]


def second_picture_estimate(data: bytes, end: int) -> DepthEstimate | None:
    """A grey picture of the photo's shape in a JPEG that follows it (it ends at `end`), which is no small copy of it.

    None where there is none, or it cannot be read, or where the photo has a gain map.
    """
    if OTHER_USE.search(data, 0, min(end, HEADER_BYTES)) and b"GainMap" in data[:end]:
        return None
    for start, last in appended_pictures(data, end):
        content = data[start:last]
        size = None if OTHER_USE.search(content[:HEADER_BYTES]) else grey_size(content)
        if size is not None and _fits(size, data) and not _is_copy(content, data):
            try:
                return DepthEstimate(decode_map(content, "the picture behind the photo"), "inverse depth")
            except InputError:
                continue
    return None


def appended_pictures(data: bytes, end: int) -> list[tuple[int, int]]:
    """Where the JPEG pictures that follow a photo (which ends at `end`) begin and end; the first few."""
    found: list[tuple[int, int]] = []
    while len(found) < MAX_PICTURES:
        start = data.find(b"\xff\xd8\xff", end)
        if start < 0:
            break
        end = max(jpeg_layout(data, start).end, start + 2)
        found.append((start, end))
    return found


def grey_size(content: bytes) -> ImageSize | None:
    """The size of a picture's bytes, None for colours and what cannot be read."""
    colors = _small(content)
    if colors is None or (np.ptp(colors, axis=2) > GREY_TOLERANCE).mean() > 0.01:
        return None
    with Image.open(BytesIO(content)) as picture:
        return ImageSize(picture.height, picture.width)


def _fits(size: ImageSize, data: bytes) -> bool:
    try:
        with Image.open(BytesIO(data)) as photo:
            ratio = photo.width * size.height / (photo.height * size.width)
    except DECODE_ERRORS:
        return False
    return abs(ratio - 1) <= MAX_ASPECT_DIFFERENCE


def _is_copy(content: bytes, data: bytes) -> bool:
    """Whether a picture looks like the photo, has texture as photos have it, or shows nothing but a matte."""
    own, photo, fine = _small(content), _small(data), _small(content, LOOKED_AT)
    if own is None or photo is None or np.ptp(own) < LEAST_RANGE:
        return True
    if fine is None or _is_textured(fine[..., 0]) or _is_matte(fine[..., 0]):
        return True
    first, second = (_standardised(pixels.astype(np.float32).mean(axis=2)) for pixels in (own, photo))
    return abs(float((first * second).mean())) > MOST_LIKENESS


def _is_textured(grey: np.ndarray) -> bool:
    steps = np.maximum(np.abs(np.diff(grey, axis=0))[:, 1:], np.abs(np.diff(grey, axis=1))[1:])
    return bool((steps > TEXTURE_STEP).mean() > MOST_TEXTURED)


def _is_matte(grey: np.ndarray) -> bool:
    counts = np.bincount(grey.ravel().astype(np.intp) // 4)
    return bool((counts > grey.size / 200).sum() < LEAST_LEVELS)


def _small(content: bytes, size: tuple[int, int] = COMPARED) -> np.ndarray | None:
    try:
        with Image.open(BytesIO(content), formats=("JPEG",)) as picture:
            picture.draft("RGB", (2 * size[0], 2 * size[1]))
            return np.asarray(picture.convert("RGB").resize(size, Image.Resampling.BOX), np.int16)
    except DECODE_ERRORS:
        return None


def _standardised(values: FloatImage) -> FloatImage:
    spread = float(values.std())
    return np.asarray((values - values.mean()) / spread if spread > 0 else values * 0, np.float32)
