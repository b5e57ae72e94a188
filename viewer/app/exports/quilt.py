"""Quilts for Looking Glass displays, drawn view by view."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from iibr_core.formats.quilts import Quilt, lay_out, quilt_for, tagged
from iibr_core.types import ImageSize
from viewer.app.exports.parallax import fitted, side_pictures
from viewer.app.exports.source import ExportSource
from viewer.model.layout import ScreenSize
from viewer.model.state.app_state import Scene
from viewer.model.state.exporting import ExportOptions


def quilt_path(path: Path, scene: Scene, options: ExportOptions) -> Path:
    """With the numbers that players read from the name. Raises InputError for a display that nobody knows."""
    return tagged(path, _quilt_of(scene, options).tag)


def write_quilt(path: Path, source: ExportSource, options: ExportOptions) -> None:
    """Raises InputError where it cannot be written, Cancelled once the export should stop."""
    from iibr_core.formats.images.picture_writers import write_picture

    quilt = _quilt_of(source.scene, options)
    pictures = side_pictures(source.scene, source.optics, quilt.views)
    frame = ScreenSize(quilt.tile.width, quilt.tile.height)
    size = fitted(pictures[0].aspect, frame, quilt.aspect)
    drawn = (source.draw(picture.optics, size, picture.part) for picture in pictures)
    tiles = (_framed(pixels, quilt) for pixels in source.watched(drawn, quilt.views, "drawing views"))
    write_picture(path, lay_out(quilt, tiles))


def _quilt_of(scene: Scene, options: ExportOptions) -> Quilt:
    return quilt_for(options.device, ImageSize(scene.height, scene.width))


def _framed(pixels: NDArray[Any], quilt: Quilt) -> NDArray[np.uint8]:
    """In the middle of a black tile."""
    tile = np.zeros((*quilt.tile, 3), np.uint8)
    height, width = pixels.shape[:2]
    top, left = (quilt.tile.height - height) // 2, (quilt.tile.width - width) // 2
    tile[top : top + height, left : left + width] = pixels
    return tile
