"""Maps of other programs: COLMAP, Sintel, ACMM and Gipuma, optical flow, Record3D; and files that cannot be read.

All hold 32-bit floats, little-endian, row by row from the top.
"""

import re
import struct
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import MAX_FILE_PIXELS, MAX_PART_BYTES, PARSE_ERRORS, parsing, read_bytes, read_text
from iibr_core.formats.images.file_kinds import unreadable_kind
from iibr_core.runtime.extras import how_to_install
from iibr_core.types import FloatImage, ImageSize, InputError

START_BYTES = 64
COLMAP = re.compile(rb"(\d{1,9})&(\d{1,9})&(\d{1,3})&")
"""Header of COLMAP's `.geometric.bin` and `.photometric.bin`: width, height, channels."""
SINTEL = b"PIEH"
"""202021.25 as a float: the start of Sintel's `.dpt`, and of optical flow (`.flo`), which has two channels."""
GIPUMA = struct.Struct("<4i")
"""Header of ACMM's and Gipuma's `.dmb`: 1 for floats, height, width, channels."""
LZFSE = re.compile(rb"bvx[-12n]")
MAX_FLOW = 1e9
"""Flow from which on it is unknown."""
RECORD3D_SIZES = {49_152: ImageSize(256, 192), 307_200: ImageSize(640, 480)}
"""Sizes of Record3D's maps by their numbers of pixels, of an upright phone: by LiDAR, by the front camera."""
WAY_OUT = "save it as NPY, PFM or a 16-bit PNG"
FOREIGN = (
    (b"MATLAB", "a file of MATLAB (.mat)"),
    (b"\x89HDF", "HDF5 (.h5, .mat)"),
    (b"SIMPLE  =", "FITS"),
    (b"CDF", "NetCDF"),
)
"""Starts of files that are not read, and their names."""


class OtherMap(NamedTuple):
    """A map of another program. name: its content, as arrays are named."""

    values: FloatImage
    name: str


def read_other_map(path: Path) -> OtherMap | None:
    """Return the map of another program, its values as stored; None for files of other kinds.

    Raises InputError for a damaged one.
    """
    start, size_bytes = read_bytes(path, START_BYTES), path.stat().st_size
    if (header := COLMAP.match(start)) is not None:
        width, height, channels = map(int, header.groups())
        return OtherMap(_plane(path, header.end(), (channels, height, width))[0], "depth")
    if start.startswith(SINTEL) and len(start) >= 12:
        width, height = struct.unpack_from("<ii", start, 4)
        if path.suffix.lower() == ".flo" or size_bytes >= 12 + 8 * width * height:
            return OtherMap(_disparity_of_flow(_plane(path, 12, (height, width, 2))[..., 0]), "disparity")
        return OtherMap(_plane(path, 12, (height, width, 1))[..., 0], "depth")
    if path.suffix.lower() == ".dmb" and len(start) >= GIPUMA.size:
        _, height, width, channels = GIPUMA.unpack_from(start)
        return OtherMap(_plane(path, GIPUMA.size, (height, width, channels))[..., 0], "depth")
    if path.suffix.lower() == ".depth" or LZFSE.match(start):
        return OtherMap(_record3d_map(path), "depth")
    return None


def map_fault(path: Path, error: InputError) -> InputError:
    """Return the error of a file that is no picture, in words for a map: what it is, and what helps."""
    start = read_bytes(path, START_BYTES)
    kind = unreadable_kind(path)
    name = next((name for mark, name in FOREIGN if start.startswith(mark)), kind.name if kind is not None else "")
    reason = str(error).removeprefix(f"{path}: ").partition("; ")[0].replace("a picture", "a map")
    return InputError(f"{path}: {f'is {name}' if name else reason}; {WAY_OUT}")


def depth_of_lzfse(data: bytes, name: str) -> FloatImage:
    """Return the floats (N,) that Record3D compressed."""
    try:
        import lzfse
    except ImportError as error:
        raise InputError(f"{name}: is compressed by LZFSE; {how_to_install('record3d')}, or {WAY_OUT}") from error
    with parsing(name, f"is no map of Record3D, or damaged ({{}}); {WAY_OUT}", (*PARSE_ERRORS, lzfse.error)):
        return np.frombuffer(lzfse.decompress(data), "<f4")


def _plane(path: Path, start: int, shape: tuple[int, int, int]) -> NDArray[Any]:
    count = int(np.prod([max(side, 0) for side in shape], dtype=np.int64))
    if min(shape) < 1 or count > 4 * MAX_FILE_PIXELS:
        raise InputError(f"{path}: claims to hold {shape[0]} x {shape[1]} x {shape[2]} values; {WAY_OUT}")
    missing = start + 4 * count - path.stat().st_size
    if missing > 0:
        raise InputError(f"{path}: cut off, {missing} bytes are missing; get the whole file again")
    return np.array(np.memmap(path, "<f4", "r", start, shape))


def _disparity_of_flow(flow: FloatImage) -> FloatImage:
    """Return the disparity of horizontal flow to another eye: most of it goes one way, and farther where it is near."""
    known = np.where(np.abs(flow) < MAX_FLOW, flow, np.float32(np.nan))
    return known * np.float32(-1 if np.nanmean(known) < 0 else 1) if np.isfinite(known).any() else known


def _record3d_map(path: Path) -> FloatImage:
    values = depth_of_lzfse(read_bytes(path), str(path))
    size = next(filter(None, map(_stated_size, (path.parent, path.parent.parent))), RECORD3D_SIZES.get(values.size))
    if size is None or size.height * size.width != values.size:
        raise InputError(f"{path}: holds {values.size:,} distances of a map whose shape is not known; {WAY_OUT}")
    return values.reshape(size)


def _stated_size(folder: Path) -> ImageSize | None:
    """Return the size that Record3D's `metadata` in a folder states."""
    try:
        text = read_text(folder / "metadata", MAX_PART_BYTES)
    except InputError:
        return None
    numbers = [re.search(rf'"{name}"\s*:\s*(\d{{1,5}})', text) for name in ("dh", "dw")]
    return ImageSize(*(int(found[1]) for found in numbers if found)) if all(numbers) else None
