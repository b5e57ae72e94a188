"""Light fields in one file: quilts and lenslet images, known by their names, and stereo photos of all kinds."""

import re
from dataclasses import replace
from pathlib import Path

from iibr_core.formats.images.heic import heic_pair
from iibr_core.formats.images.open_picture import open_picture
from iibr_core.formats.images.picture_source import PicturePart, PictureSource, source_size
from iibr_core.formats.images.side_by_side import refuse_raw_light_field, stated_pair
from iibr_core.formats.images.stereo_jpeg import SOURCE_IMAGE, is_stereo_mpo, open_lif
from iibr_core.formats.light_fields.multi_view_scene import GridIndex, KnownView, MultiView
from iibr_core.formats.light_fields.pair_files import pair_of, read_two_files
from iibr_core.formats.light_fields.write import LENSLET_KEY, LENSLET_TAG
from iibr_core.formats.maps.disparity_file import has_shape_of
from iibr_core.formats.quilts import TAG, Quilt, quilt_named
from iibr_core.types import GridShape, ImageSize, InputError, ViewOffset

MAX_ASPECT_ERROR = 0.02
"""Share by which the shape of a tile may differ from the displayed shape without stretching: sides are whole pixels."""
LYTRO_LENSLET = GridShape(14, 14)
LYTRO_USABLE = slice(3, 11)
"""Rows and columns of a Lytro's views that are used: farther out, the lens's edge darkens the corners."""


def read_quilt(path: Path) -> MultiView | None:
    """Return the views of a quilt, the leftmost first; None if the file is not named as a quilt."""
    if not TAG.search(path.stem):
        return None
    quilt = quilt_named(path, source_size(PictureSource(path)))
    assert quilt is not None
    shown_size = _shown_size(quilt)
    sources = []
    for k in range(quilt.views):
        rows, columns = quilt.place(k)
        sources.append(PictureSource(path, 0, PicturePart((rows.start, columns.start), quilt.tile), shown_size))
    views = tuple(_view(f"view {k}", (0, k), source) for k, source in enumerate(sources))
    layout = f"quilt, {quilt.columns}x{quilt.rows} views"
    across = quilt.columns if quilt.columns > 1 else quilt.views
    grid, numbers = GridShape(1, quilt.views), tuple(divmod(k, across) for k in range(quilt.views))
    return MultiView(TAG.sub("", path.stem) or path.stem, layout, views, grid=grid, numbers=numbers, is_stated=True)


def _shown_size(quilt: Quilt) -> ImageSize | None:
    """Return the size of a tile with square pixels, enlarged along one side; None if its pixels are square."""
    (height, width), aspect = quilt.tile, quilt.aspect
    if abs(width / height / aspect - 1) <= MAX_ASPECT_ERROR:
        return None
    wider = round(height * aspect)
    return ImageSize(height, wider) if wider >= width else ImageSize(max(round(width / aspect), 1), width)


def read_lenslet_image(path: Path) -> MultiView | None:
    """Return the views of a lenslet image (`*_eslf.png`), as the Stanford Lytro archive has them; None for other names.

    The pixels under one lens lie together as a small rectangle, one pixel of each view. A Lytro's outer views are left
    out.
    """
    if not LENSLET_TAG.search(path.stem):
        return None
    picture = open_picture(path)
    stored, stated = picture.size, re.fullmatch(r"(\d{1,4})x(\d{1,4})", picture.text(LENSLET_KEY))
    lenslet = GridShape(int(stated[2]), int(stated[1])) if stated else LYTRO_LENSLET
    if min(lenslet) < 1 or stored.height % lenslet.rows or stored.width % lenslet.columns:
        raise InputError(
            f"{path}: {stored} pixels are not a whole number of lenses of {lenslet.columns}x{lenslet.rows};"
            " is its name right?"
        )
    size = ImageSize(stored.height // lenslet.rows, stored.width // lenslet.columns)
    rows, columns = (range(count)[slice(None) if stated else LYTRO_USABLE] for count in lenslet)
    views = tuple(
        _view(f"v{v:02d} u{u:02d}", (v, u), PictureSource(path, part=PicturePart((row, column), size, lenslet)))
        for v, row in enumerate(rows)
        for u, column in enumerate(columns)
    )
    grid = GridShape(len(rows), len(columns))
    layout = f"lenslet image, {grid.columns}x{grid.rows} of {lenslet.columns}x{lenslet.rows} views"
    return MultiView(LENSLET_TAG.sub("", path.stem), layout, views, grid=grid)


def read_stereo_file(path: Path) -> MultiView | None:
    """Return the two views of a stereo photo, or of a file and the other eye's beside it; None for other files."""
    refuse_raw_light_field(path)
    stereo = _stereo_pictures(path)
    if stereo is None:
        files = pair_of(path)
        return None if files is None else read_two_files(*files)
    layout, left, right = stereo
    views = _view("left", (0, 0), left), _view("right", (0, 1), right)
    return MultiView(path.stem, layout, views, grid=GridShape(1, 2))


def _stereo_pictures(path: Path) -> tuple[str, PictureSource, PictureSource] | None:
    """Return the layout, the left eye's picture and the right eye's picture."""
    kind = open_picture(path).kind
    if kind == "HEIC" and (numbers := heic_pair(path)) is not None:
        return "spatial HEIC", PictureSource(path, numbers[0]), PictureSource(path, numbers[1])
    if (halves := stated_pair(path)[0]) is not None:
        return "side-by-side stereo", *halves
    if kind != "JPEG":
        return None
    if (leia := open_lif(path)) is not None:
        fields = [0 if view.image == SOURCE_IMAGE else view.image for view in leia.views]
        return ("Leia stereo", _leia_picture(path, fields[0]), _leia_picture(path, fields[-1])) if fields[1:] else None
    return ("MPO stereo", PictureSource(path, 0), PictureSource(path, 1)) if is_stereo_mpo(path) else None


def _leia_picture(path: Path, number: int) -> PictureSource:
    """Return a picture of a Leia image, at the size of the main one: the Lume Pad 2 stores some smaller."""
    picture, size = PictureSource(path, number), open_picture(path).upright_size
    stored = source_size(picture)
    return replace(picture, shown_size=size) if number and stored != size and has_shape_of(stored, size) else picture


def _view(name: str, place: GridIndex, picture: PictureSource) -> KnownView:
    return KnownView(name, ViewOffset(float(place[0]), float(place[1])), picture, place=place)
