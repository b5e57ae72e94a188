"""PFM files: one float per pixel, rows bottom-up in the file, top-down here. The scale's sign gives the byte order."""

import re
from pathlib import Path
from typing import Any

import numpy as np

from iibr_core.formats.files import MAX_FILE_PIXELS, open_binary
from iibr_core.formats.outputs import write_file
from iibr_core.types import FloatImage, ImageSize, InputError

HEADER = re.compile(rb"P([fF])\s+(\d{1,9})\s+(\d{1,9})\s+([-+.0-9eE]{1,32})(?:\r\n|\s)")
"""One white-space character, or CR LF, ends the header; the next byte is data."""
HEADER_BYTES = 256


def read_pfm(path: Path) -> FloatImage:
    """Return the map (H, W), row 0 at the top, with the values as stored (NaN and infinity too).

    The magnitude of the scale is ignored, as by Middlebury and HCI. Colour PFMs are refused.
    """
    path = Path(path)
    with open_binary(path) as file:
        size, dtype, start = _header(path, file.read(HEADER_BYTES))
        missing = start + 4 * size.width * size.height - path.stat().st_size
        if missing > 0:
            raise InputError(f"{path}: cut off, {missing} bytes are missing for {size} values")
        return np.array(np.memmap(file, dtype, "r", start, size)[::-1], np.float32)


def read_pfm_size(path: Path) -> ImageSize:
    """Return (height, width) from the header."""
    with open_binary(path) as file:
        return _header(path, file.read(HEADER_BYTES))[0]


def write_pfm(path: Path, values: FloatImage) -> None:
    """Write an (H, W) map, little-endian float32, whole or not at all."""
    height, width = values.shape
    with write_file(Path(path)) as temporary:
        header = f"Pf\n{width} {height}\n-1.0\n".encode()
        temporary.write_bytes(header + values[::-1].astype("<f4").tobytes())


def _header(path: Path, start: bytes) -> tuple[ImageSize, np.dtype[Any], int]:
    """Return the size, the type of the values, and the first byte of the values. start: of the file."""
    match = HEADER.match(start)
    if match is None:
        raise InputError(f"{path}: is not a PFM file (no header 'Pf width height scale')")
    if match[1] == b"F":
        raise InputError(f"{path}: is a colour PFM; a disparity map has one value per pixel ('Pf')")
    width, height = int(match[2]), int(match[3])
    if not 0 < width * height <= MAX_FILE_PIXELS:
        raise InputError(f"{path}: {width}x{height} pixels; a map has 1 to {MAX_FILE_PIXELS:,}")
    return ImageSize(height, width), np.dtype("<f4" if match[4].startswith(b"-") else ">f4"), match.end()
