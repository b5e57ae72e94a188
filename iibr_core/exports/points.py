"""The scene in three dimensions: points with colours (PLY), or Gaussian splats (PLY as 3DGS stores them, or SPZ).

They are the surfaces of the photo, and the inpainted surfaces behind them (Kerbl et al. 2023 for splats).
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.exports.cameras import cameras_of, colors_of, nearest_metres
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.source import ExportSource
from iibr_core.formats.outputs import write_file
from iibr_core.formats.spz import write_spz
from iibr_core.method.farthest_views import outer_views_of_grid
from iibr_core.types import CENTRE, FloatImage, GridShape, InputError, ViewOffset

SAME_DISPARITY_PX = 0.1
"""Largest disparity difference, in pixels per view step, of inpainted pixels of several views that become one point."""

RGB = ("red", "green", "blue")
Y_UP = np.array([1, -1, -1], np.float32)
"""Factors of x, y and z from cameras' axes, y down and z forward, to those of models, y up and z backwards."""
SH_BASIS_0 = 0.28209479177387814
"""Constant spherical harmonic: colour = 0.5 + SH_BASIS_0 * f_dc."""
OPACITY = 0.98
PIXELS_PER_SIGMA = 0.6
"""Radius of a splat in pixels: neighbours then close a surface, with little blur."""
PLY_TYPES = {"f4": "float", "u1": "uchar"}

Mask = NDArray[np.bool_]
Points = tuple[FloatImage, NDArray[np.uint8], FloatImage]
"""Places (N, 3), x right, y down, z forward; colours (N, 3); widths of a pixel at these places (N,)."""


@dataclass(frozen=True, eq=False)
class Surfaces:
    """Surfaces that a view at `offset` adds to the scene.

    colors: (H, W, 3), sRGB-encoded. disparity: (H, W). mask: (H, W), the pixels that show them.
    """

    offset: ViewOffset
    colors: NDArray[np.uint8]
    disparity: FloatImage
    mask: Mask


def write_point_cloud(path: Path, source: ExportSource, options: ExportOptions) -> None:
    """Write a PLY file of points, y up and z backwards, as most viewers of point clouds expect."""
    places, colors, _ = scene_points(source)
    _write_ply(path, dict(zip("xyz", (places * Y_UP).T)) | dict(zip(RGB, colors.T)))


def write_gaussians(path: Path, source: ExportSource, options: ExportOptions) -> str | None:
    """Write Gaussian splats: as PLY y down and z forward, as 3DGS leaves them, as SPZ y up and z backwards."""
    points, colors, pixel = scene_points(source)
    radii = np.maximum(np.float32(PIXELS_PER_SIGMA) * pixel, np.float32(1e-12))
    if path.suffix.lower() == ".ply":
        _write_ply(path, _gaussian_columns(points, colors, radii))
        return None
    factor = write_spz(path, points * Y_UP, radii, colors, OPACITY)
    return None if factor == 1 else f"Lengths are {factor:g} times as large: SPZ cannot store splats as small as these."


def _gaussian_columns(points: FloatImage, colors: NDArray[np.uint8], radii: FloatImage) -> dict[str, NDArray[Any]]:
    """Return the columns of a PLY file of round splats."""
    zeros, ones = np.zeros(len(points), np.float32), np.ones(len(points), np.float32)
    shade = (colors.astype(np.float32) / 255 - 0.5) / SH_BASIS_0
    columns: dict[str, NDArray[Any]] = dict(zip("xyz", points.T)) | dict.fromkeys(("nx", "ny", "nz"), zeros)
    columns |= {f"f_dc_{i}": shade[:, i] for i in range(3)}
    columns["opacity"] = ones * np.log(OPACITY / (1 - OPACITY))
    columns |= {f"scale_{i}": np.log(radii) for i in range(3)}
    return columns | {"rot_0": ones, "rot_1": zeros, "rot_2": zeros, "rot_3": zeros}  # w first


def scene_points(source: ExportSource) -> Points:
    """Return the pixels of the centre view and the inpainted pixels of the corner views as points.

    They are in metres if distances are known in metres, otherwise in distances of the nearest point.
    """
    cameras = cameras_of(source)
    parts: list[Points] = []
    seen: set[tuple[int, int, int]] = set()
    for surface in surfaces_of(source, cameras.grid):
        mask = _new(surface, seen) if any(surface.offset) else surface.mask
        places = cameras.points(surface.disparity, surface.offset)[mask]
        parts.append((places, surface.colors[mask], places[:, 2] / np.float32(cameras.focal_px)))
    places, colors, pixel = (np.concatenate(arrays) for arrays in zip(*parts))
    unit = np.float32(nearest_metres(source) or 1.0)
    return places * unit, colors, pixel * unit


def surfaces_of(source: ExportSource, grid: GridShape) -> Iterator[Surfaces]:
    """Yield the surfaces of the centre view, then those that were inpainted in the corner views."""
    outer = outer_views_of_grid(grid)
    views = source.views(wanted=outer)
    centre = next(views)
    if centre.disparity is None:
        raise InputError(f"{source.scene.name}: no depth is known; open it with a disparity map")
    yield Surfaces(CENTRE, colors_of(centre), centre.disparity, np.isfinite(centre.disparity))
    for view in views:
        offset = grid.offset(view.row, view.column)
        if offset in outer and view.disparity is not None and view.inpainted is not None:
            yield Surfaces(offset, colors_of(view), view.disparity, view.inpainted)


def _new(surfaces: Surfaces, seen: set[tuple[int, int, int]]) -> Mask:
    """Return a mask (H, W) of the pixels whose points are not in `seen`, and add them to it."""
    mask, offset = surfaces.mask.copy(), surfaces.offset
    y, x = np.nonzero(mask)
    d = surfaces.disparity[y, x]
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
