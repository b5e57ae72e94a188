"""The centre view's disparity and depth as maps, and an epipolar plane image."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from iibr_core.exports.camera_export import cameras_of, colors_of, nearest_metres
from iibr_core.exports.options import ExportOptions
from iibr_core.exports.settings import ExportSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.maps.map_text import MapText
from iibr_core.formats.maps.writer import write_map
from iibr_core.formats.quilts import tagged
from iibr_core.scenes.scene import Scene
from iibr_core.types import InputError


def depth_path(path: Path, scene: Scene, options: ExportOptions) -> Path:
    """With the word that tells depth from disparity."""
    return tagged(path, "_depth")


def write_disparity(path: Path, source: ExportSource, settings: ExportSettings) -> str:
    """Px per view step; returns what is to be known of the file."""
    return write_map(path, _disparity_of(source))


def write_depth(path: Path, source: ExportSource, settings: ExportSettings) -> str:
    """In metres where they are known, else in distances of the nearest; returns what is to be known of the file."""
    cameras = cameras_of(source)
    depth, metres = cameras.depth(_disparity_of(source)), nearest_metres(source)
    if metres is not None:
        return write_map(path, depth * np.float32(metres), MapText("depth", unit="m"))
    inverse = (cameras.range_px[1] - cameras.at_infinity, cameras.at_infinity)
    return write_map(path, depth, MapText("depth", unit="distances of the nearest", inverse=inverse))


def write_epi(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """A row of the picture in each view of the centre row of views, the leftmost on top."""
    from iibr_core.formats.images.photo import write_image

    scene = source.scene
    if not 0 <= settings.row < scene.height:
        raise InputError(f"row {settings.row}: {scene.name} has rows 0 to {scene.height - 1}")
    middle, columns = scene.grid.centre[0], range(scene.grid.columns)
    views = source.views(wanted=[scene.grid.offset(middle, column) for column in columns])
    lines = {view.column: colors_of(view)[settings.row] for view in views if view.row == middle}
    write_image(path, np.stack([lines[column] for column in sorted(lines)]))


def _disparity_of(source: ExportSource) -> np.ndarray:
    disparity = source.centre_view().disparity
    if disparity is None:
        raise InputError(f"{source.scene.name}: has no disparity")
    return disparity
