"""Quilts of light-field displays, known by their names (`formats.quilts`): views in a row, the leftmost first."""

from __future__ import annotations

from pathlib import Path

from iibr_core.formats.files import shown_name
from iibr_core.formats.images.picture_source import PicturePart, PictureSource, source_size
from iibr_core.formats.light_fields.multi_view_scene import KnownView, MultiView
from iibr_core.formats.quilts import TAG, Quilt, quilt_named
from iibr_core.types import GridShape, ImageSize, ViewOffset

SAME_ASPECT = 0.02
"""Tiles whose shape is as near to what is displayed stay as they are: sides are whole pixels."""


def read_quilt(path: Path) -> MultiView | None:
    """The views of a quilt, None where the file is not named as one. Raises InputError where that cannot be."""
    if not TAG.search(path.stem):
        return None
    quilt = quilt_named(path, source_size(PictureSource(path)))
    assert quilt is not None
    views = tuple(_view(path, quilt, k) for k in range(quilt.views))
    layout = f"quilt, {quilt.columns}x{quilt.rows} views"
    return MultiView(shown_name(TAG.sub("", path.stem)), layout, views, grid=GridShape(1, quilt.views))


def _view(path: Path, quilt: Quilt, number: int) -> KnownView:
    rows, columns = quilt.place(number)
    part = PicturePart((rows.start, columns.start), quilt.tile)
    return KnownView(
        f"view {number}",
        ViewOffset(0.0, float(number)),
        PictureSource(path, 0, part, _shown_size(quilt)),
        None,
        (0, number),
    )


def _shown_size(quilt: Quilt) -> ImageSize | None:
    """Of a tile with square pixels; none is lost. None where its pixels are square."""
    (height, width), aspect = quilt.tile, quilt.aspect
    if abs(width / height / aspect - 1) <= SAME_ASPECT:
        return None
    wider = round(height * aspect)
    return ImageSize(height, wider) if wider >= width else ImageSize(max(round(width / aspect), 1), width)
