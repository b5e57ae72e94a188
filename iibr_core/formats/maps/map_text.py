"""The meaning of a map's values, as text in the header of a PNG, TIFF or EXR: reading gives back the map as written."""

from __future__ import annotations

import math
from typing import Literal

import msgspec

KEY = "ImageDescription"
"""The header's field: PNG, TIFF and EXR all have it."""
START = "iibr map "


class MapText(msgspec.Struct, frozen=True):
    """value = stored number * scale + offset; a stored 0 of a PNG is unknown.

    meaning: "disparity", px per view step of a picture as wide as the map, larger is nearer; "depth", larger is
    farther, in `unit`. inverse: (slope, offset) of disparity over 1 / depth, where depth was computed from it.
    """

    meaning: Literal["disparity", "depth"]
    scale: float = 1.0
    offset: float = 0.0
    unit: str = "px per view step"
    inverse: tuple[float, float] | None = None


def text_of(text: MapText) -> str:
    """For the header."""
    return START + msgspec.json.encode(text).decode()


def text_from(text: str) -> MapText | None:
    """None where a header's text is not ours, or damaged."""
    if not text.startswith(START):
        return None
    try:
        found = msgspec.json.decode(text.removeprefix(START), type=MapText)
    except msgspec.DecodeError:
        return None
    numbers = (found.scale, found.offset, *(found.inverse or ()))
    return found if all(map(math.isfinite, numbers)) and found.scale != 0 else None
