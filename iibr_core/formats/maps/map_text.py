"""The meaning of a map's values, as text in the header of a PNG, TIFF or EXR: reading gives back the map as written."""

from __future__ import annotations

import math
from typing import Literal

import msgspec

KEY = "ImageDescription"
"""The header's field, which PNG, TIFF and EXR all have."""
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
    """Return the header's text."""
    return START + msgspec.json.encode(text).decode()


def text_from(text: str) -> MapText | None:
    """Return the meaning that a header's text states; None where it is not ours, or damaged."""
    try:
        found = msgspec.json.decode(text.removeprefix(START), type=MapText) if text.startswith(START) else None
    except msgspec.DecodeError:
        return None
    numbers = (found.scale, found.offset, *(found.inverse or ())) if found else ()
    return found if found and found.scale != 0 and all(map(math.isfinite, numbers)) else None
