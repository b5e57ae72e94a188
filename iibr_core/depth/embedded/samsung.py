"""Depth maps in the trailer that Samsung phones append to their JPEG photos ("SEFT").

Samsung publishes no description. The trailer's layout and where the map's size stands are as ExifTool's authors found
them; that dark is near, as users of such files found. Distances are not known: the map is relative.
"""

from __future__ import annotations

import re
import struct

import numpy as np

from iibr_core.depth.estimate import DepthEstimate
from iibr_core.types import ImageSize, InputError

DIRECTORY_START, DIRECTORY_END, AUDIO_BLOCK_END = b"SEFH", b"SEFT", b"QDIOBS"
MAX_DIRECTORY_BYTES = 0x10000
DEPTH_MAP_TYPE, SIZE_TYPE = 0x0AB1, 0x0AB3
DEPTH_MAP_NAME = b"DualShot_DepthMap_1"
# The map's width and height follow this mark, which stands at a multiple of 4 in bytes 32 to 95.
SIZE_MARK = re.compile(rb"[\x01-\x09]\x00\xff\xff")


def samsung_estimate(data: bytes) -> DepthEstimate | None:
    """The depth map of a photo taken with "Live focus", None where there is none or its layout is another one.

    Raises InputError where the trailer names a map that it does not hold.
    """
    blocks = _blocks(data)
    depth_map, size_info = blocks.get((DEPTH_MAP_TYPE, DEPTH_MAP_NAME)), _first(blocks, SIZE_TYPE)
    if depth_map is None or size_info is None:
        return None
    size = _map_size(size_info)
    if size is None:
        return None
    height, width = size
    if width < 1 or height < 1 or width * height != len(depth_map):
        raise InputError(f"Samsung's depth map of {width}x{height} pixels holds {len(depth_map):,} bytes")
    stored = np.frombuffer(depth_map, np.uint8).reshape(height, width)
    return DepthEstimate(np.float32(1) - stored.astype(np.float32) / np.float32(255), "inverse depth")


def _blocks(data: bytes) -> dict[tuple[int, bytes], bytes]:
    """The trailer's blocks by type and name; empty where there is no such trailer."""
    end = len(data) - 2 if data.endswith(AUDIO_BLOCK_END) else len(data)
    while end >= 8 and data[end - 4 : end].isalnum():  # blocks lie end to end, their lengths behind them
        length = int.from_bytes(data[end - 8 : end - 4], "little")
        if not 4 <= length < min(MAX_DIRECTORY_BYTES, end - 8):
            break
        start = end - 8 - length
        if data[end - 4 : end] == DIRECTORY_END:
            return _directory_blocks(data, start, length)
        end = start
    return {}


def _directory_blocks(data: bytes, start: int, length: int) -> dict[tuple[int, bytes], bytes]:
    """What the directory at `start` lists: type, how far before the directory the block begins, its size."""
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
        name_length = int.from_bytes(block[4:8], "little")
        blocks.setdefault((kind, block[8 : 8 + name_length]), block[8 + name_length :])
    return blocks


def _first(blocks: dict[tuple[int, bytes], bytes], kind: int) -> bytes | None:
    return next((block for (other, _), block in blocks.items() if other == kind), None)


def _map_size(size_info: bytes) -> ImageSize | None:
    """The size from the block that holds it somewhere."""
    for mark in SIZE_MARK.finditer(size_info, 32, 96):
        if mark.start() % 4 == 0 and mark.end() + 8 <= len(size_info):
            width, height = struct.unpack("<II", size_info[mark.end() : mark.end() + 8])
            return ImageSize(height, width)
    return None
