"""Arrays of numbers in NPY files and NPZ archives. NPY files are mapped: a cut one is refused before memory is used."""

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.files import parsing, require_file
from iibr_core.types import InputError

USUAL_NAMES = (
    "depth", "disparity", "disp", "metric_depth", "predicted_depth", "pred_depth", "depth_pred", "depth_map", "arr_0",
)  # fmt: skip
"""Names of the array that is read from an archive of several arrays, the best first."""


def read_named_array(path: Path, max_values: int) -> tuple[NDArray[Any], str]:
    """Return the array of an NPY file, read-only, or the map in an NPZ archive; and its name there, "" without."""
    require_file(path)
    with parsing(path, "is not a complete array ({}); get the file again"):
        stored = np.load(path, mmap_mode="r", allow_pickle=False)
        is_array = isinstance(stored, np.ndarray)
        array, name = (stored, "") if is_array else _map_in(path, stored, max_values)
    if array.dtype.kind not in "fiu":
        raise InputError(f"{path}: holds {array.dtype} of shape {array.shape}; an array of numbers is expected")
    if array.size > max_values:
        raise InputError(f"{path}: {array.size:,} values are more than {max_values:,}; make it smaller")
    return array, name


def _map_in(path: Path, archive: Any, max_values: int) -> tuple[NDArray[Any], str]:
    """Return the only array of an archive, or the one with a usual name, and its name."""
    with archive:
        names = archive.files
        usual = [name for name in USUAL_NAMES if name in names]
        if len(names) != 1 and not usual:
            listed = ", ".join(names[:5]) or "none"
            raise InputError(f"{path}: which array is the map ({listed})? Save it alone, or name it depth or disparity")
        name = (usual or names)[0]
        size_bytes = archive.zip.getinfo(f"{name}.npy").file_size
        if size_bytes > 16 * max_values:
            raise InputError(f"{path}: {name} of {size_bytes:,} bytes is too large; make it smaller")
        return np.asarray(archive[name]), name
