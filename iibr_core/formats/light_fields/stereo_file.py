"""Stereo photos in one file: spatial HEIC, multi-picture JPEG, Leia images, two pictures side by side."""

from __future__ import annotations

from pathlib import Path

from iibr_core.formats.files import shown_name
from iibr_core.formats.images.heic import heic_pair, is_heic
from iibr_core.formats.images.lif import SOURCE_IMAGE, open_lif
from iibr_core.formats.images.mpo import is_jpeg, is_stereo_mpo
from iibr_core.formats.images.picture_source import PictureSource
from iibr_core.formats.images.side_by_side import require_developed, side_by_side_pair
from iibr_core.formats.light_fields.multi_view_scene import KnownView, MultiView
from iibr_core.types import GridShape, ViewOffset

EYES = "left", "right"


def read_stereo_file(path: Path) -> MultiView | None:
    """The two views of a stereo photo, None where a file holds none.

    Raises InputError where it is damaged, and for raw files of light-field cameras.
    """
    require_developed(path)
    found = _pair(path)
    if found is None:
        return None
    layout, pictures = found
    views = tuple(
        KnownView(name, ViewOffset(0.0, float(u)), picture, place=(0, u))
        for u, (name, picture) in enumerate(zip(EYES, pictures))
    )
    return MultiView(shown_name(path.stem), layout, views, grid=GridShape(1, 2))


def _pair(path: Path) -> tuple[str, tuple[PictureSource, PictureSource]] | None:
    """What it is, and the left eye's picture and the right one's."""
    if is_heic(path) and (numbers := heic_pair(path)) is not None:
        return "spatial HEIC", _numbered(path, *numbers)
    side_by_side = side_by_side_pair(path)
    if side_by_side is not None:
        return "side-by-side stereo", side_by_side
    if not is_jpeg(path):
        return None
    leia = open_lif(path)
    if leia is not None:
        fields = [0 if view.image == SOURCE_IMAGE else view.image for view in leia.views]
        return ("Leia stereo", _numbered(path, fields[0], fields[-1])) if len(fields) > 1 else None
    return ("MPO stereo", _numbered(path, 0, 1)) if is_stereo_mpo(path) else None


def _numbered(path: Path, left: int, right: int) -> tuple[PictureSource, PictureSource]:
    return PictureSource(path, left), PictureSource(path, right)
