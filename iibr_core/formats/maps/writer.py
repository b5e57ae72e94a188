"""Writes disparity maps, one value per pixel, so that `reader.read_map` reads them again."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.images.oiio_writer import write_image_file
from iibr_core.formats.maps.pfm import write_pfm
from iibr_core.formats.outputs import atomic_write
from iibr_core.types import FloatImage, InputError

MAP_SUFFIXES = (".pfm", ".exr", ".npy", ".png")
PNG_MOST = 65535
"""The largest value of a 16-bit picture; 0 means unknown there."""


def write_map(path: Path, values: FloatImage) -> str:
    """Write an (H, W) map of finite values, whole or not at all; returns what is to be known of the file, or "".

    `.pfm`, `.exr` and `.npy` hold the values as they are (float32). `.png` holds them from 1 to 65535: how much they
    were multiplied and moved is what comes back. Raises InputError for other endings, names that end in `_depth` (read
    as depth, not disparity), and where the file cannot be written.
    """
    path = Path(path)
    kind = path.suffix.lower()
    if kind not in MAP_SUFFIXES:
        raise InputError(f"{path}: a disparity map can be written as {', '.join(MAP_SUFFIXES)}")
    if path.stem.endswith("_depth"):
        raise InputError(f"{path}: a name ending in _depth means depth, this is disparity; choose another name")
    if kind == ".png":
        step, low = _write_png(path, values)
        return f"Its values are disparity in steps of {step:.6g} px (--disparity-scale), moved by {step - low:.6g} px."
    _write_floats(path, values)
    return ""


def write_depth_map(path: Path, values: FloatImage) -> str:
    """The same for an (H, W) map of depths, in any unit. Raises InputError for names that do not end in `_depth`."""
    kind = path.suffix.lower()
    if kind not in MAP_SUFFIXES or not path.stem.endswith("_depth"):
        raise InputError(f"{path}: a depth map must end in _depth and {', '.join(MAP_SUFFIXES)}")
    if kind == ".png":
        step, low = _write_png(path, values)
        return f"Its values are depth: {step:.6g} times the value, and {low - step:.6g}."
    _write_floats(path, values)
    return ""


def _write_floats(path: Path, values: FloatImage) -> None:
    kind = path.suffix.lower()
    if kind == ".pfm":
        write_pfm(path, values)
    elif kind == ".npy":
        with atomic_write(path) as temporary:
            np.save(temporary, np.asarray(values, np.float32))
    else:
        _write_plane(path, np.asarray(values, np.float32), "float")


def _write_png(path: Path, values: FloatImage) -> tuple[float, float]:
    """How much a step of the stored values is, and the least value, which is stored as 1."""
    low, high = float(values.min()), float(values.max())
    step = (high - low) / (PNG_MOST - 1) or 1.0
    stored = np.rint((values.astype(np.float64) - low) / step).astype(np.uint16) + np.uint16(1)
    _write_plane(path, stored, "uint16")
    return step, low


def _write_plane(path: Path, values: FloatImage | NDArray[np.uint16], dtype: str) -> None:
    write_image_file(path, values[..., None], dtype, channels=("Y",))
