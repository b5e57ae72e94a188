"""Exported pictures in the colours of saved ones, with what the photo's file says of the photo."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from iibr_core.exports.source import ExportSource
from iibr_core.formats.images.picture_kinds import AS_USUAL, PictureFormat
from iibr_core.types import SRGB, ColorSpace


def saved_space(source: ExportSource) -> ColorSpace:
    """What pictures of this scene are saved in, unless the user says otherwise."""
    return AS_USUAL.space_for(source.scene.color_space)


def write_with_metadata(
    path: Path,
    pixels: NDArray[Any],
    source: ExportSource,
    form: PictureFormat = AS_USUAL,
    color_space: ColorSpace = SRGB,
) -> None:
    """As `write_picture`: pixels (H, W, 3) of color_space. Raises InputError where it cannot be written."""
    from iibr_core.formats.images.metadata import PictureMetadata, read_metadata
    from iibr_core.formats.images.picture_writers import write_picture

    of_photo = PictureMetadata() if source.loaded is None else read_metadata(Path(source.scene.source.path))
    write_picture(path, pixels, form, PictureMetadata(of_photo.exif, of_photo.xmp), color_space)
