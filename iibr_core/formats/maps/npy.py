"""NPY arrays, alone or in an NPZ archive, from files that may be anything: numbers only, no pickles, no memory before
it is known that the file holds as much.
"""

from __future__ import annotations

import math
import tokenize
import zipfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, Any

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from iibr_core.formats.files import open_binary, reason_of
from iibr_core.types import InputError

HEADERS = {(1, 0): npy_format.read_array_header_1_0, (2, 0): npy_format.read_array_header_2_0}
# What numpy and zipfile raise for damaged files: headers are parsed as Python.
MISREADINGS = (
    ValueError,
    EOFError,
    OverflowError,
    TypeError,
    SyntaxError,
    tokenize.TokenError,
    MemoryError,
    zipfile.BadZipFile,
    NotImplementedError,
    RuntimeError,
)
USUAL_NAMES = ("depth", "disparity", "disp", "arr_0", "predicted_depth")
"""Names of the array that is read from an archive of several arrays, the best first."""


def read_array(path: Path, most_values: int, member: str = "") -> NDArray[Any]:
    """The array of an NPY file, or a member of an NPZ archive. Raises InputError where there is none, one of other
    than numbers, or a larger one.
    """
    with _open(path, member) as (file, size):
        shape, dtype = _header(path, file)
        count = math.prod(shape)
        if dtype.kind not in "fiu":
            raise InputError(f"{path}: holds {dtype} of shape {shape}; an array of numbers is expected")
        if count > most_values:
            raise InputError(f"{path}: {count:,} values are more than {most_values:,}; make it smaller")
        missing = file.tell() + count * dtype.itemsize - size
        if missing > 0:
            raise InputError(f"{path}: cut off, {missing} bytes are missing for an array of shape {shape}")
        file.seek(0)
        try:
            return np.asarray(npy_format.read_array(file, allow_pickle=False))
        except MISREADINGS as error:  # it became shorter meanwhile, or is empty in one direction and endless in another
            raise InputError(
                f"{path}: cannot be read as an array of shape {shape}; get the whole file again"
            ) from error


def read_array_header(path: Path, member: str = "") -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and type of the array of an NPY file, or an NPZ archive's member. Raises InputError where there is none."""
    with _open(path, member) as (file, _):
        return _header(path, file)


def npz_member(path: Path) -> str:
    """The member of an NPZ archive that holds its map: the only one, or the one with a usual name.

    Raises InputError where that leaves open which is meant.
    """
    with _archive(path) as archive:
        names = [name for name in archive.namelist() if name.endswith(".npy")]
    usual = [f"{name}.npy" for name in USUAL_NAMES if f"{name}.npy" in names]
    if len(names) != 1 and not usual:
        said = ", ".join(name.removesuffix(".npy") for name in names[:5]) or "none"
        raise InputError(f"{path}: which array is the map ({said})? Save it alone, or name it depth or disparity")
    return (usual or names)[0]


@contextmanager
def _archive(path: Path) -> Iterator[zipfile.ZipFile]:
    with open_binary(path) as file:
        try:
            archive = zipfile.ZipFile(file)
        except MISREADINGS as error:
            raise InputError(
                f"{path}: cannot be read as an NPZ archive ({reason_of(error)}); get the whole file again"
            ) from error
        yield archive


@contextmanager
def _open(path: Path, member: str) -> Iterator[tuple[IO[bytes], int]]:
    """An array's bytes, and how many there are."""
    if not member:
        with open_binary(path) as file:
            yield file, path.stat().st_size
        return
    with _archive(path) as archive:
        try:
            stream = archive.open(member)
        except MISREADINGS as error:
            raise InputError(
                f"{path}: {member} cannot be read ({reason_of(error)}); get the whole file again"
            ) from error
        with stream:
            yield stream, archive.getinfo(member).file_size


def _header(path: Path, file: IO[bytes]) -> tuple[tuple[int, ...], np.dtype[Any]]:
    try:
        version = npy_format.read_magic(file)
        if version not in HEADERS:
            raise ValueError(f"version {version}")
        shape, _, dtype = HEADERS[version](file)
        if min(shape, default=0) < 0:
            raise ValueError(f"shape {shape}")
    except MISREADINGS as error:
        raise InputError(
            f"{path}: cannot be read as a NumPy array ({reason_of(error)}); get the whole file again"
        ) from error
    return shape, dtype
