"""The whole light field, in the layouts of `WRITERS`."""

from __future__ import annotations

from contextlib import closing
from pathlib import Path

from iibr_core.exports.kinds import ExportOptions
from iibr_core.exports.source import ExportSource
from iibr_core.formats.light_fields import write


def write_light_field(path: Path, source: ExportSource, options: ExportOptions, variant: str) -> None:
    """Write all views, with the disparity of every view if the layout has a place for it.

    Raises InputError if the field cannot be written, Cancelled once the export should stop.
    """
    scene = source.scene
    focal_px = source.focal_px or float(scene.width)
    with closing(source.views()) as views:
        write.write_light_field(path, variant, scene.grid, views, focal_px, scene.name, True)
