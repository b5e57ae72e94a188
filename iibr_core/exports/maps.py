"""Maps of the centre view's disparity and depth, pictures with their depth, and epipolar plane images."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from iibr_core.color import bytes_from_encoded
from iibr_core.exports.cameras import cameras_of, colors_of, nearest_metres
from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.source import ExportSource
from iibr_core.formats.images.write import write_image
from iibr_core.formats.maps.writer import MapText, write_map
from iibr_core.formats.quilts import tagged
from iibr_core.scenes.scene import Scene
from iibr_core.types import FloatImage, InputError


def depth_path(path: Path, scene: Scene, options: ExportOptions) -> Path:
    """Return the path with a tag that distinguishes depth from disparity."""
    return tagged(path, "_depth")


def write_disparity(path: Path, source: ExportSource, options: ExportOptions) -> str:
    """Write the disparity in pixels per view step; return a sentence about the file."""
    return write_map(path, _disparity_of(source)[1])


def write_depth(path: Path, source: ExportSource, options: ExportOptions) -> str:
    """Write the depth in metres if these are known, otherwise in distances of the nearest point; return a sentence."""
    cameras = cameras_of(source)
    depth, metres = cameras.depth(_disparity_of(source)[1]), nearest_metres(source)
    if metres is not None:
        return write_map(path, depth * np.float32(metres), MapText("depth", unit="m"))
    inverse = (cameras.range_px[1] - cameras.at_infinity, cameras.at_infinity)
    return write_map(path, depth, MapText("depth", unit="distances of the nearest", inverse=inverse))


def write_rgbd(path: Path, source: ExportSource, options: ExportOptions) -> None:
    """Write the centre view with its disparity beside it, black for the farthest and white for the nearest pixel."""
    colors, disparity = _disparity_of(source)
    far, near = float(disparity.min()), float(disparity.max())
    nearness = bytes_from_encoded((disparity - far) / ((near - far) or 1.0))
    pictures = [colors, np.repeat(nearness[..., None], 3, axis=2)]
    if options.layout == "left":
        pictures.reverse()
    source.write_picture(path, np.concatenate(pictures, axis=0 if options.layout == "below" else 1))


def write_epi(path: Path, source: ExportSource, options: ExportOptions) -> None:
    """Write one row of each view in the centre row of views as a picture, the leftmost view on top."""
    scene = source.scene
    if options.row >= scene.height:
        raise InputError(f"row {options.row}: {scene.name} has rows 0 to {scene.height - 1}")
    middle, columns = scene.grid.centre[0], range(scene.grid.columns)
    views = source.views(wanted=[scene.grid.offset(middle, column) for column in columns])
    lines = {view.column: colors_of(view)[options.row] for view in views if view.row == middle}
    write_image(path, np.stack([lines[column] for column in sorted(lines)]))


def _disparity_of(source: ExportSource) -> tuple[NDArray[np.uint8], FloatImage]:
    """Return colours (H, W, 3) and disparity (H, W) of the centre view."""
    view, disparity = source.depth_view()
    return colors_of(view), disparity
