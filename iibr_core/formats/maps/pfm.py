"""PFM files: one float per pixel, rows bottom-up in the file, top-down here. The scale's sign gives the byte order."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

from iibr_core.color import ROWS_AT_ONCE
from iibr_core.formats.files import MAX_FILE_PIXELS, open_binary
from iibr_core.formats.outputs import write_file
from iibr_core.types import FloatImage, ImageSize, InputError

# The header ends with exactly one white-space character (or CR LF); the next byte is data.
HEADER = re.compile(rb"P([fF])\s+(\d{1,9})\s+(\d{1,9})\s+([-+.0-9eE]{1,32})(?:\r\n|\s)")
HEADER_BYTES = 256


def read_pfm(path: Path) -> FloatImage:
    """The map as (H, W) float32, row 0 at the top, values as stored (NaN and inf too).

    The magnitude of the scale is ignored, as Middlebury and HCI mean it. Raises InputError for colour PFMs, a header
    that makes no sense, and files that are missing or cut off.
    """
    path = Path(path)
    with open_binary(path) as file:
        size, dtype, start = _header(path, file)
        missing = start + 4 * size.width * size.height - path.stat().st_size
        if missing > 0:
            raise InputError(f"{path}: cut off, {missing} bytes are missing for {size} values")
        file.seek(start)
        result = np.empty(size, np.float32)
        # From the last row up, some at a time: turned over as a whole, a large map would be there twice.
        for bottom in range(size.height, 0, -ROWS_AT_ONCE):
            rows = result[max(bottom - ROWS_AT_ONCE, 0) : bottom]
            values = np.fromfile(file, dtype, rows.size)
            if values.size < rows.size:
                raise InputError(f"{path}: became shorter while it was read; try again")
            rows[:] = values.reshape(rows.shape)[::-1]
    return result


def read_pfm_size(path: Path) -> ImageSize:
    """Return (height, width) from the header. Raises InputError as `read_pfm` does."""
    with open_binary(path) as file:
        return _header(path, file)[0]


def _header(path: Path, file: BinaryIO) -> tuple[ImageSize, np.dtype[Any], int]:
    """Size, type of the values, and where they begin."""
    match = HEADER.match(file.read(HEADER_BYTES))
    if match is None:
        raise InputError(f"{path}: is not a PFM file (no header 'Pf width height scale')")
    if match[1] == b"F":
        raise InputError(f"{path}: is a colour PFM; a disparity map has one value per pixel ('Pf')")
    width, height = int(match[2]), int(match[3])
    if not 0 < width * height <= MAX_FILE_PIXELS:
        raise InputError(f"{path}: {width}x{height} pixels; a map has 1 to {MAX_FILE_PIXELS:,}")
    dtype = np.dtype("<f4") if _scale(path, match[4]) < 0 else np.dtype(">f4")
    return ImageSize(height, width), dtype, match.end()


def write_pfm(path: Path, values: FloatImage) -> None:
    """Write an (H, W) map, little-endian float32, whole or not at all. Raises InputError where it cannot be written."""
    height, width = values.shape
    with write_file(Path(path)) as temporary:
        header = f"Pf\n{width} {height}\n-1.0\n".encode()
        temporary.write_bytes(header + values[::-1].astype("<f4").tobytes())


def _scale(path: Path, text: bytes) -> float:
    try:
        scale = float(text)
    except ValueError:
        scale = 0.0
    if scale == 0 or not np.isfinite(scale):
        raise InputError(f"{path}: scale '{text.decode()}' in the header must be a number other than 0")
    return scale
