"""Parts of a photo's file that look like depth or like another picture, and are not read: named, so that nobody has to
guess why a photo with a depth map is shown with a guess.
"""

from __future__ import annotations

import re
from io import BytesIO
from pathlib import Path

from PIL import Image

from iibr_core.depth.embedded.embedded_depth import jpeg_bytes
from iibr_core.depth.embedded.images import DECODE_ERRORS
from iibr_core.depth.embedded.trailers import HEADER_BYTES, appended_pictures, grey_size
from iibr_core.depth.embedded.xmp import jpeg_layout
from iibr_core.formats.images.heic import heic_auxiliaries, is_heic

TRAILERS = (
    (re.compile(rb"PMPD[\x01-\x09]\0"), "a depth map of Xiaomi's kind (PMPD)"),
    (re.compile(rb"DualShot_DepthMap"), "a depth map of Samsung's of another layout than the known ones"),
    (re.compile(rb"\0edof\0"), "a depth map of Huawei's of another layout than the known ones"),
)
"""Marks behind a photo, and what they begin."""
MATTE = re.compile(rb"urn:com:apple:photo:\d+:aux:(?:semantic)?(\w+?)matte")
MATTES = "mattes ({}), which are no depth maps"
GAIN_MAP = re.compile(rb"hdrgm:|HDRGainMap|GainMap|urn:iso:std:iso:ts:21496|aux:hdrgainmap", re.IGNORECASE)
CONTAINER = re.compile(rb"MPF\0|photos/1.0/container/|photos/dd/1.0/container/|GCamera:MicroVideo")
"""Lists of what lies behind a photo: previews, gain maps and films, which nobody takes for depth."""
MAX_NAMED = 3


def unread_parts(path: Path) -> tuple[str, ...]:
    """Return a sentence for each part of a photo's file that is not read: "x.jpg holds ..., which is not read."

    Meant for photos that hold no depth that is read. Raises InputError where the file is missing.
    """
    parts = _in_heic(path) if is_heic(path) else _in_jpeg(jpeg_bytes(path))
    return tuple(f"{path.name} holds {part}; this is not read." for part in parts)


def _in_heic(path: Path) -> list[str]:
    return _mattes(" ".join(heic_auxiliaries(path)).encode())


def _in_jpeg(data: bytes) -> list[str]:
    if not data:
        return []
    end = jpeg_layout(data).end
    parts = [words for mark, words in TRAILERS if mark.search(data, end)] + _mattes(data[end:])
    if CONTAINER.search(data, 0, min(end, HEADER_BYTES)):
        return parts
    pictures = (_words(data[start:last]) for start, last in appended_pictures(data, end))
    return parts + [f"a second picture ({words})" for words in pictures if words][:MAX_NAMED]


def _mattes(data: bytes) -> list[str]:
    names = dict.fromkeys(found.group(1).decode() for found in MATTE.finditer(data))
    return [MATTES.format(", ".join(names).replace("portraiteffects", "portrait effects"))] if names else []


def _words(content: bytes) -> str:
    """Describe a picture's bytes; "" for gain maps, mattes and what cannot be read."""
    if GAIN_MAP.search(content, 0, HEADER_BYTES) or MATTE.search(content, 0, HEADER_BYTES):
        return ""
    try:
        with Image.open(BytesIO(content), formats=("JPEG",)) as picture:
            width, height = picture.size
    except DECODE_ERRORS:
        return ""
    return f"{width}x{height}, {'colour' if grey_size(content) is None else 'grey'}"
