"""The scene in three dimensions: the photo's surfaces, and the inpainted ones behind them."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.exports.camera_export import cameras_of, colors_of, nearest_metres
from iibr_core.exports.settings import ExportSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.cameras import FieldCameras
from iibr_core.formats.ply import write_points, write_splats
from iibr_core.types import FloatImage, InputError, ViewUpdate

SAME_DISPARITY_PX = 0.1
"""Made-up pixels of several views are one where they agree so well, per view step, and look at one pixel."""

Points = tuple[FloatImage, NDArray[np.uint8], FloatImage]
"""Places (N, 3), x right, y down, z forward; colours (N, 3); how wide a pixel is there (N,)."""


def write_point_cloud(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """As a PLY, y up and z backwards, as most viewers of points look."""
    places, colors, _ = scene_points(source)
    write_points(path, places * np.array([1, -1, -1], np.float32), colors)


def write_gaussians(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """As a PLY of 3DGS, y down and z forward, as its training leaves them."""
    write_splats(path, *scene_points(source))


def scene_points(source: ExportSource) -> Points:
    """The centre view's pixels, and what was inpainted in the corner views; in metres where distances are known in
    them, else in distances of the nearest.

    Raises InputError without depth, Cancelled once the export should stop.
    """
    cameras = cameras_of(source)
    found: list[Points] = []
    seen: set[tuple[int, int, int]] = set()
    rows, columns = cameras.grid
    corners = {(row, column) for row in (0, rows - 1) for column in (0, columns - 1)}
    for view in source.views(wanted=[cameras.grid.offset(*corner) for corner in corners]):
        at = view.row, view.column
        if view.disparity is None or (at != cameras.grid.centre and (at not in corners or view.inpainted is None)):
            continue
        mask = np.ones(view.disparity.shape, bool) if at == cameras.grid.centre else _new(view, cameras, seen)
        places = cameras.points(view.disparity, cameras.grid.offset(*at))[mask]
        found.append((places, colors_of(view)[mask], places[:, 2] / np.float32(cameras.focal_px)))
    if not found:
        raise InputError(f"{source.scene.name}: no depth is known; open it with a disparity map")
    places, colors, pixel = (np.concatenate(arrays) for arrays in zip(*found))
    unit = np.float32(nearest_metres(source) or 1.0)
    return places * unit, colors, pixel * unit


def _new(view: ViewUpdate, cameras: FieldCameras, seen: set[tuple[int, int, int]]) -> NDArray[np.bool_]:
    """Which made-up pixels (H, W) no view before showed; they are taken note of."""
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
