"""Quilts for Looking Glass displays, drawn view by view."""

from __future__ import annotations

from pathlib import Path

from iibr_core.exports.framing import draw_framed
from iibr_core.exports.looking_glass import Bridge
from iibr_core.exports.options import ExportOptions
from iibr_core.exports.parallax import side_pictures
from iibr_core.exports.pictures import write_with_metadata
from iibr_core.exports.render_settings import RenderSettings
from iibr_core.exports.settings import ExportSettings
from iibr_core.exports.source import ExportSource
from iibr_core.formats.quilts import Quilt, lay_out, quilt_for, tagged
from iibr_core.rendering.optics import Optics
from iibr_core.scenes.scene import Scene
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import ImageSize


def quilt_path(path: Path, scene: Scene, options: ExportOptions) -> Path:
    """With the numbers that players read from the name. Raises InputError for a display that nobody knows."""
    return tagged(path, _quilt_of(scene, options.device).tag)


def optics_of_quilt(scene: Scene, optics: Optics, settings: ExportSettings) -> list[Optics]:
    """Of its views, from the leftmost. Raises InputError where what is in focus cannot be held still."""
    tile, count = RenderSettings(optics, settings.size), _quilt_of(scene, settings.device).views
    return [picture.optics for picture in side_pictures(scene, tile, count, settings.eyes)]


def write_quilt(path: Path, source: ExportSource, settings: ExportSettings) -> str | None:
    """And show it, where that is asked for; returns a sentence about that.

    Raises InputError where it cannot be written or shown, Cancelled once the export should stop.
    """
    bridge = Bridge() if settings.show else None  # before anything is drawn, for there may be none
    quilt = _quilt_of(source.scene, settings.device)
    tile = RenderSettings(source.optics, ScreenSize(quilt.tile.width, quilt.tile.height))
    pictures = side_pictures(source.scene, tile, quilt.views, settings.eyes)
    drawn = (draw_framed(source, picture, quilt.aspect) for picture in pictures)
    write_with_metadata(path, lay_out(quilt, source.watched(drawn, quilt.views, "drawing views")), source)
    return bridge.show_quilt(path, quilt) if bridge is not None else None


def _quilt_of(scene: Scene, device: str | None) -> Quilt:
    return quilt_for(device, ImageSize(scene.height, scene.width))
