"""Segments of a JPEG file before its picture data, read from the file one by one."""

from __future__ import annotations

from collections.abc import Iterator
from typing import BinaryIO

JPEG_START, START_OF_SCAN = b"\xff\xd8", 0xDA


def jpeg_segments(file: BinaryIO) -> Iterator[tuple[int, bytes]]:
    """Yield the marker and content of each segment before the first scan; none where the file is no JPEG."""
    if file.read(2) != JPEG_START:
        return
    while len(mark := file.read(4)) == 4 and mark[0] == 0xFF and mark[1] != START_OF_SCAN:
        yield mark[1], file.read(max(int.from_bytes(mark[2:], "big") - 2, 0))
