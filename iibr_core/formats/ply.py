"""PLY files: points with colours, and Gaussian splats as 3DGS stores them (Kerbl et al. 2023)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.outputs import write_file
from iibr_core.types import FloatImage

SH_BASIS_0 = 0.28209479177387814
"""The constant spherical harmonic: colour = 0.5 + SH_BASIS_0 * f_dc."""
OPACITY = 0.98
PIXELS_PER_SIGMA = 0.6
"""Neighbouring splats of a surface then close it, and blur it hardly."""
PLY_TYPES = {"f4": "float", "u1": "uchar"}


def write_points(path: Path, points: FloatImage, colors: NDArray[np.uint8]) -> None:
    """A point cloud: points and colours, (N, 3) each. Raises InputError where it cannot be written."""
    columns: dict[str, NDArray[Any]] = dict(zip("xyz", points.T.astype("<f4")))
    columns |= dict(zip(("red", "green", "blue"), colors.T))
    write_ply(path, columns)


def write_splats(path: Path, points: FloatImage, colors: NDArray[np.uint8], pixel: FloatImage) -> None:
    """Splats that look alike from everywhere. points: (N, 3). colors: (N, 3), sRGB-encoded. pixel: (N,), how wide a
    pixel is there. Raises InputError where it cannot be written.
    """
    count = len(points)
    shade = (colors.astype(np.float32) / 255 - 0.5) / SH_BASIS_0
    scale = np.log(np.maximum(PIXELS_PER_SIGMA * pixel, 1e-12))
    zeros, ones = np.zeros(count, np.float32), np.ones(count, np.float32)
    columns: dict[str, NDArray[Any]] = dict(zip("xyz", points.T))
    columns |= dict.fromkeys(("nx", "ny", "nz"), zeros)
    columns |= {f"f_dc_{i}": shade[:, i] for i in range(3)}
    columns["opacity"] = np.full(count, np.log(OPACITY / (1 - OPACITY)), np.float32)
    columns |= {f"scale_{i}": scale for i in range(3)}
    columns |= {"rot_0": ones, "rot_1": zeros, "rot_2": zeros, "rot_3": zeros}  # w first
    write_ply(path, {name: column.astype("<f4") for name, column in columns.items()})


def write_ply(path: Path, columns: Mapping[str, NDArray[Any]]) -> None:
    """A PLY of vertices with these properties, each (N,), float32 or uint8; whole or not at all. Raises InputError."""
    fields = [(name, column.dtype.newbyteorder("<")) for name, column in columns.items()]
    table = np.empty(len(next(iter(columns.values()))), fields)
    for name, column in columns.items():
        table[name] = column
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(table)}"]
    lines += [f"property {PLY_TYPES[dtype.str[1:]]} {name}" for name, dtype in fields]
    with write_file(path) as temporary, temporary.open("wb") as file:
        file.write("\n".join([*lines, "end_header", ""]).encode("ascii"))
        file.write(table.tobytes())
