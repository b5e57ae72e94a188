"""Spatial photos, for headsets."""

from __future__ import annotations

from pathlib import Path

from iibr_core.exports.settings import ExportSettings
from iibr_core.exports.source import ExportSource
from iibr_core.exports.stereo_export import draw_eyes
from iibr_core.formats.images.spatial_photo import write_spatial_photo


def write_spatial(path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """Raises InputError where it cannot be written, Cancelled once the export should stop."""
    left, right = draw_eyes(source, settings)
    focal_px = source.loaded.photo.focal_px if source.loaded is not None else source.scene.focal_px
    scale = left.shape[0] / source.scene.height
    write_spatial_photo(path, left, right, scale * (focal_px or source.scene.width))
