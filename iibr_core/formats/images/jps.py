"""Stereo JPEGs (JPS): how their two pictures lie, by the descriptor that VRex put into segment APP3."""

from __future__ import annotations

from pathlib import Path
from typing import Literal, NamedTuple

from iibr_core.formats.files import open_binary
from iibr_core.formats.images.jpeg_segments import jpeg_segments

APP3, IDENTIFIER = 0xE3, b"_JPSJPS_"
DESCRIPTOR_AT = 10
"""First byte of the descriptor: separation, flags, layout, type, a byte each."""
STEREO = 1
HALF_HEIGHT, HALF_WIDTH, LEFT_FIRST = 1, 2, 4
Arrangement = Literal["rows", "beside", "over"]
LAYOUTS: dict[int, Arrangement] = {1: "rows", 2: "beside", 3: "over"}


class JpsDescriptor(NamedTuple):
    """Arrangement of two pictures: in every other row, side by side, or one over the other.

    is_half: each is squeezed to half its size. right_first: the right eye's is at the left or at the top.
    """

    arrangement: Arrangement
    is_half: bool
    right_first: bool


def read_jps_descriptor(path: Path) -> JpsDescriptor | None:
    """Return the descriptor of a JPEG of two pictures; None for other files, and for anaglyphs.

    Raises InputError where the file cannot be read.
    """
    with open_binary(path) as file:
        contents = (content for marker, content in jpeg_segments(file) if marker == APP3)
        found = next((content for content in contents if content.startswith(IDENTIFIER)), b"")
    _, flags, layout, kind = found[DESCRIPTOR_AT : DESCRIPTOR_AT + 4].ljust(4, b"\0")
    if kind != STEREO or layout not in LAYOUTS:
        return None
    arrangement = LAYOUTS[layout]
    is_half = bool(flags & (HALF_WIDTH if arrangement == "beside" else HALF_HEIGHT))
    return JpsDescriptor(arrangement, is_half, right_first=not flags & LEFT_FIRST)
