"""The whole light field, in the layouts that `WRITERS` knows."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

from iibr_core.exports.settings import ExportSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.light_fields.light_field_formats import writer_for


def write_light_field(layout: str, path: Path, source: ExportSource, settings: ExportSettings) -> None:
    """With every view's disparity, where there is one and the layout has a place for it.

    Raises InputError where it cannot be written, Cancelled once the export should stop.
    """
    scene = source.scene
    focal_px = source.loaded.photo.focal_px if source.loaded is not None else scene.focal_px or float(scene.width)
    views = source.views()
    with writer_for(layout)(path, scene.grid, focal_px, scene.name, True) as writer, closing(views):
        for view in views:
            writer.add(view)
