"""Lenslet images (`*_eslf.png`), as the Stanford Lytro archive has them: what each lens saw lies together as a small
rectangle, a pixel of each view.
"""

from __future__ import annotations

import re
from pathlib import Path

from iibr_core.formats.files import shown_name
from iibr_core.formats.images.oiio_reader import PictureRows, text_attribute
from iibr_core.formats.images.picture_source import PicturePart, PictureSource
from iibr_core.formats.light_fields.multi_view_scene import KnownView, MultiView
from iibr_core.formats.light_fields.whole_field import LENSLET_KEY, LENSLET_TAG
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset

LYTRO_LENSLET = GridShape(14, 14)
USABLE = slice(3, 11)
"""Rows and columns of a Lytro's views: beyond them the lens's edge darkens the corners."""


def read_lenslet_image(path: Path) -> MultiView | None:
    """The views of a lenslet image, None where the file is not named as one; a Lytro's without those at its edge.

    Raises InputError where its sides are no multiples of a lens's.
    """
    if not LENSLET_TAG.search(path.stem):
        return None
    header = PictureRows(path)
    own = re.fullmatch(r"(\d{1,4})x(\d{1,4})", text_attribute(header.spec, LENSLET_KEY))
    lenslet = GridShape(int(own[2]), int(own[1])) if own else LYTRO_LENSLET
    size = _view_size(path, header.size, lenslet)
    usable = slice(None) if own else USABLE
    rows, columns = range(lenslet.rows)[usable], range(lenslet.columns)[usable]
    views = tuple(
        KnownView(
            f"v{v:02d} u{u:02d}",
            ViewOffset(float(v), float(u)),
            PictureSource(path, part=PicturePart((row, column), size, lenslet)),
            place=(v, u),
        )
        for v, row in enumerate(rows)
        for u, column in enumerate(columns)
    )
    grid = GridShape(len(rows), len(columns))
    layout = f"lenslet image, {grid.columns}x{grid.rows} of {lenslet.columns}x{lenslet.rows} views"
    return MultiView(shown_name(LENSLET_TAG.sub("", path.stem)), layout, views, grid=grid)


def _view_size(path: Path, size: ImageSize, lenslet: GridShape) -> ImageSize:
    if min(lenslet) < 1 or size.height % lenslet.rows or size.width % lenslet.columns:
        raise InputError(
            f"{path}: {size} pixels are not a whole number of lenses of {lenslet.columns}x{lenslet.rows};"
            " is its name right?"
        )
    return ImageSize(size.height // lenslet.rows, size.width // lenslet.columns)
