"""Write PLY files: points with colours, and Gaussian splats as 3DGS stores them (Kerbl et al. 2023)."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.outputs import write_file
from iibr_core.types import FloatImage

SH_BASIS_0 = 0.28209479177387814
"""Constant spherical harmonic: colour = 0.5 + SH_BASIS_0 * f_dc."""
OPACITY = 0.98
PIXELS_PER_SIGMA = 0.6
"""Radius of a splat in pixels: neighbours then close a surface, with little blur."""
PLY_TYPES = {"f4": "float", "u1": "uchar"}


def write_points(path: Path, points: FloatImage, colors: NDArray[np.uint8]) -> None:
    """Write a point cloud. points, colors: (N, 3)."""
    _write_ply(path, dict(zip("xyz", points.T)) | dict(zip(("red", "green", "blue"), colors.T)))


def write_splats(path: Path, points: FloatImage, colors: NDArray[np.uint8], pixel: FloatImage) -> None:
    """Write splats whose colours depend on no direction.

    points: (N, 3). colors: (N, 3), sRGB-encoded. pixel: (N,), width of a pixel at each point, in the unit of `points`.
    """
    zeros, ones = np.zeros(len(points), np.float32), np.ones(len(points), np.float32)
    shade = (colors.astype(np.float32) / 255 - 0.5) / SH_BASIS_0
    scale = np.log(np.maximum(PIXELS_PER_SIGMA * pixel, 1e-12))
    columns: dict[str, NDArray[Any]] = dict(zip("xyz", points.T)) | dict.fromkeys(("nx", "ny", "nz"), zeros)
    columns |= {f"f_dc_{i}": shade[:, i] for i in range(3)}
    columns["opacity"] = ones * np.log(OPACITY / (1 - OPACITY))
    columns |= {f"scale_{i}": scale for i in range(3)}
    columns |= {"rot_0": ones, "rot_1": zeros, "rot_2": zeros, "rot_3": zeros}  # w first
    _write_ply(path, columns)


def _write_ply(path: Path, columns: Mapping[str, NDArray[Any]]) -> None:
    """Write a PLY of vertices. columns: property names with arrays (N,), stored as bytes (uint8) or floats."""
    fields = [(name, "<f4" if column.dtype.kind == "f" else "u1") for name, column in columns.items()]
    table = np.empty(len(next(iter(columns.values()))), fields)
    for name, column in columns.items():
        table[name] = column
    lines = ["ply", "format binary_little_endian 1.0", f"element vertex {len(table)}"]
    lines += [f"property {PLY_TYPES[kind[-2:]]} {name}" for name, kind in fields]
    with write_file(path) as temporary:
        temporary.write_bytes("\n".join([*lines, "end_header", ""]).encode("ascii") + table.tobytes())
