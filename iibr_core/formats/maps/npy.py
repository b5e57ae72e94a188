"""NPY arrays from files that may be anything: numbers only, no pickles, no archives, no memory before it is known that
the file holds as much.
"""

from __future__ import annotations

import math
import tokenize
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from iibr_core.formats.files import open_binary, reason_of
from iibr_core.types import InputError

HEADERS = {(1, 0): npy_format.read_array_header_1_0, (2, 0): npy_format.read_array_header_2_0}
# What numpy raises for damaged headers: it parses them as Python.
MISREADINGS = (ValueError, EOFError, OverflowError, TypeError, SyntaxError, tokenize.TokenError, MemoryError)


def read_array(path: Path, most_values: int) -> NDArray[Any]:
    """The array of an NPY file. Raises InputError where there is none, one of other than numbers, or a larger one."""
    with open_binary(path) as file:
        shape, dtype = _header(path, file)
        count = math.prod(shape)
        if dtype.kind not in "fiu":
            raise InputError(f"{path}: holds {dtype} of shape {shape}; an array of numbers is expected")
        if count > most_values:
            raise InputError(f"{path}: {count:,} values are more than {most_values:,}; make it smaller")
        missing = file.tell() + count * dtype.itemsize - path.stat().st_size
        if missing > 0:
            raise InputError(f"{path}: cut off, {missing} bytes are missing for an array of shape {shape}")
        file.seek(0)
        try:
            return np.asarray(npy_format.read_array(file, allow_pickle=False))
        except MISREADINGS as error:  # it became shorter meanwhile, or is empty in one direction and endless in another
            raise InputError(
                f"{path}: cannot be read as an array of shape {shape}; get the whole file again"
            ) from error


def read_array_header(path: Path) -> tuple[tuple[int, ...], np.dtype[Any]]:
    """Shape and type of the array of an NPY file. Raises InputError where there is none."""
    with open_binary(path) as file:
        return _header(path, file)


def _header(path: Path, file: BinaryIO) -> tuple[tuple[int, ...], np.dtype[Any]]:
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
