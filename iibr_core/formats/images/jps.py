"""Stereo JPEGs (JPS): the arrangement of their two pictures by VRex's descriptor in segment APP3."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import BinaryIO, Literal, NamedTuple

from iibr_core.formats.files import open_binary

JPEG_START, START_OF_SCAN = b"\xff\xd8", 0xDA
APP3, IDENTIFIER = 0xE3, b"_JPSJPS_"
DESCRIPTOR_AT = 10
"""First byte of the descriptor: one byte each for separation, flags, layout and type."""
STEREO = 1
HALF_HEIGHT, HALF_WIDTH, LEFT_FIRST = 1, 2, 4
Arrangement = Literal["rows", "beside", "over"]
LAYOUTS: dict[int, Arrangement] = {1: "rows", 2: "beside", 3: "over"}


class JpsDescriptor(NamedTuple):
    """Arrangement of two pictures: in every other row, side by side, or one over the other.

    is_half: both are squeezed to half their size. right_first: the right eye's is at the left or at the top.
    """

    arrangement: Arrangement
    is_half: bool
    right_first: bool


def read_jps_descriptor(path: Path) -> JpsDescriptor | None:
    """Return the descriptor of a JPEG of two pictures; None for other files, and for anaglyphs.

    Raises InputError where the file cannot be read.
    """
    with open_binary(path) as file:
        contents = (content for marker, content in _segments(file) if marker == APP3)
        found = next((content for content in contents if content.startswith(IDENTIFIER)), b"")
    _, flags, layout, kind = found[DESCRIPTOR_AT : DESCRIPTOR_AT + 4].ljust(4, b"\0")
    if kind != STEREO or layout not in LAYOUTS:
        return None
    arrangement = LAYOUTS[layout]
    is_half = bool(flags & (HALF_WIDTH if arrangement == "beside" else HALF_HEIGHT))
    return JpsDescriptor(arrangement, is_half, right_first=not flags & LEFT_FIRST)


def _segments(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Yield marker and content of each segment before the first scan; none where the file is no JPEG."""
    if file.read(2) != JPEG_START:
        return
    while len(mark := file.read(4)) == 4 and mark[0] == 0xFF and mark[1] != START_OF_SCAN:
        yield mark[1], file.read(max(int.from_bytes(mark[2:], "big") - 2, 0))
