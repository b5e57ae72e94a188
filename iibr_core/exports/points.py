"""The scene in three dimensions, as PLY files: points with colours, or Gaussian splats as 3DGS stores them.

They are the surfaces of the photo, and the inpainted surfaces behind them (Kerbl et al. 2023 for splats).
"""

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.exports.cameras import cameras_of, colors_of, nearest_metres
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.source import ExportSource
from iibr_core.formats.cameras import FieldCameras
from iibr_core.formats.outputs import write_file
from iibr_core.types import FloatImage, InputError, ViewUpdate

SAME_DISPARITY_PX = 0.1
"""Largest disparity difference, in pixels per view step, of inpainted pixels of several views that become one point."""

RGB = ("red", "green", "blue")
SH_BASIS_0 = 0.28209479177387814
"""Constant spherical harmonic: colour = 0.5 + SH_BASIS_0 * f_dc."""
OPACITY = 0.98
PIXELS_PER_SIGMA = 0.6
"""Radius of a splat in pixels: neighbours then close a surface, with little blur."""
PLY_TYPES = {"f4": "float", "u1": "uchar"}

Points = tuple[FloatImage, NDArray[np.uint8], FloatImage]
"""Places (N, 3), x right, y down, z forward; colours (N, 3); widths of a pixel at these places (N,)."""


def write_point_cloud(path: Path, source: ExportSource, options: ExportOptions) -> None:
    """Write a PLY file of points, y up and z backwards, as most viewers of point clouds expect."""
    places, colors, _ = scene_points(source)
    _write_ply(path, dict(zip("xyz", (places * np.array([1, -1, -1], np.float32)).T)) | dict(zip(RGB, colors.T)))


def write_gaussians(path: Path, source: ExportSource, options: ExportOptions) -> None:
    """Write a PLY file of Gaussian splats, y down and z forward, as 3DGS leaves them."""
    points, colors, pixel = scene_points(source)
    zeros, ones = np.zeros(len(points), np.float32), np.ones(len(points), np.float32)
    shade = (colors.astype(np.float32) / 255 - 0.5) / SH_BASIS_0
    scale = np.log(np.maximum(PIXELS_PER_SIGMA * pixel, 1e-12))
    columns: dict[str, NDArray[Any]] = dict(zip("xyz", points.T)) | dict.fromkeys(("nx", "ny", "nz"), zeros)
    columns |= {f"f_dc_{i}": shade[:, i] for i in range(3)}
    columns["opacity"] = ones * np.log(OPACITY / (1 - OPACITY))
    columns |= {f"scale_{i}": scale for i in range(3)}
    columns |= {"rot_0": ones, "rot_1": zeros, "rot_2": zeros, "rot_3": zeros}  # w first
    _write_ply(path, columns)


def scene_points(source: ExportSource) -> Points:
    """Return the pixels of the centre view and the inpainted pixels of the corner views as points.

    They are in metres if distances are known in metres, otherwise in distances of the nearest point.
    """
    cameras = cameras_of(source)
    parts: list[Points] = []
    seen: set[tuple[int, int, int]] = set()
    rows, columns = cameras.grid
    corners = {(row, column) for row in (0, rows - 1) for column in (0, columns - 1)}
    for view in source.views(wanted=[cameras.grid.offset(*corner) for corner in corners]):
        at = view.row, view.column
        if view.disparity is None or (at != cameras.grid.centre and (at not in corners or view.inpainted is None)):
            continue
        mask = np.ones(view.disparity.shape, bool) if at == cameras.grid.centre else _new(view, cameras, seen)
        places = cameras.points(view.disparity, cameras.grid.offset(*at))[mask]
        parts.append((places, colors_of(view)[mask], places[:, 2] / np.float32(cameras.focal_px)))
    if not parts:
        raise InputError(f"{source.scene.name}: no depth is known; open it with a disparity map")
    places, colors, pixel = (np.concatenate(arrays) for arrays in zip(*parts))
    unit = np.float32(nearest_metres(source) or 1.0)
    return places * unit, colors, pixel * unit


def _new(view: ViewUpdate, cameras: FieldCameras, seen: set[tuple[int, int, int]]) -> NDArray[np.bool_]:
    """Return a mask (H, W) of the inpainted pixels whose points are not in `seen`, and add them to it."""
    assert view.disparity is not None
    assert view.inpainted is not None
    offset = cameras.grid.offset(view.row, view.column)
    mask = view.inpainted.copy()
    y, x = np.nonzero(mask)
    d = view.disparity[y, x]
    keys = np.stack([np.rint(x + d * offset.s), np.rint(y + d * offset.t), np.rint(d / SAME_DISPARITY_PX)], axis=-1)
    for i, key in enumerate(map(tuple, keys.astype(int).tolist())):
        if key in seen:
            mask[y[i], x[i]] = False
        seen.add(key)
    return mask


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
