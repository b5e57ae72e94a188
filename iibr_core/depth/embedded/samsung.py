"""Depth maps in the trailer that Samsung phones append to their photos ("SEFT").

Samsung publishes no description. ExifTool's authors found the trailer's layout and the place of the map's size; users
found that dark is near. Distances are unknown: the map is relative.
"""

from __future__ import annotations

import re
import struct

import numpy as np

from iibr_core.depth.estimate import DepthEstimate
from iibr_core.types import InputError

DIRECTORY_START, DIRECTORY_END, AUDIO_BLOCK_END = b"SEFH", b"SEFT", b"QDIOBS"
MAX_DIRECTORY_BYTES = 0x10000
DEPTH_MAP, SIZE_TYPE = (0x0AB1, b"DualShot_DepthMap_1"), 0x0AB3
"""Type and name of the map's block, and type of the block with its size."""
SIZE = re.compile(rb"(?s)(?:.{4}){8,23}?[\x01-\x09]\x00\xff\xff(.{4})(.{4})")
"""Width and height, after a mark at a multiple of 4 in bytes 32 to 95."""


def samsung_estimate(data: bytes) -> DepthEstimate | None:
    """Return the depth map of a photo taken with "Live focus", None without, or if its layout is unknown.

    Raises InputError if the trailer names a map that it does not hold.
    """
    blocks = _blocks(data)
    depth_map = blocks.get(DEPTH_MAP)
    size = SIZE.match(next((block for (kind, _), block in blocks.items() if kind == SIZE_TYPE), b""))
    if depth_map is None or size is None:
        return None
    width, height = (int.from_bytes(side, "little") for side in size.groups())
    if width < 1 or height < 1 or width * height != len(depth_map):
        raise InputError(f"Samsung's depth map of {width}x{height} pixels holds {len(depth_map):,} bytes")
    stored = np.frombuffer(depth_map, np.uint8).reshape(height, width)
    return DepthEstimate(np.float32(1) - stored.astype(np.float32) / np.float32(255), "inverse depth")


def _blocks(data: bytes) -> dict[tuple[int, bytes], bytes]:
    """Return the trailer's blocks by type and name; none without such a trailer."""
    end = len(data) - 2 if data.endswith(AUDIO_BLOCK_END) else len(data)
    while end >= 8 and data[end - 4 : end].isalnum():  # blocks lie end to end, their lengths behind them
        length = int.from_bytes(data[end - 8 : end - 4], "little")
        if not 4 <= length < min(MAX_DIRECTORY_BYTES, end - 8):
            break
        start = end - 8 - length
        if data[end - 4 : end] == DIRECTORY_END:
            return _listed_blocks(data, start, length)
        end = start
    return {}


def _listed_blocks(data: bytes, start: int, length: int) -> dict[tuple[int, bytes], bytes]:
    """Return the blocks that the directory at `start` lists: type, distance from the directory, size."""
    directory = data[start : start + length]
    if not directory.startswith(DIRECTORY_START) or length < 12:
        return {}
    count = int.from_bytes(directory[8:12], "little")
    blocks: dict[tuple[int, bytes], bytes] = {}
    for at in range(12, min(12 + 12 * count, length - 11), 12):
        kind, back, size = struct.unpack("<2xHII", directory[at : at + 12])
        if back > start or not 8 <= size <= back:
            break
        block = data[start - back : start - back + size]
        name_end = 8 + int.from_bytes(block[4:8], "little")
        blocks.setdefault((kind, block[8:name_end]), block[name_end:])
    return blocks
