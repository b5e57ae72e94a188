"""Which photos lie in a folder, and whether a folder is one of photos rather than a light field."""

from __future__ import annotations

import os
import re
from collections.abc import Container, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from iibr_core.depth.sidecar import SIDECAR_KINDS
from iibr_core.exports.kinds import EXPORTS
from iibr_core.formats.light_fields.light_field_formats import find_light_field

PHOTO_ENDINGS = frozenset(
    [
        ".jpg",
        ".jpeg",
        ".png",
        ".tif",
        ".tiff",
        ".exr",
        ".hdr",
        ".webp",
        ".bmp",
        ".heic",
        ".heif",
        ".hif",
        ".avif",
        ".mpo",
        ".lif",
        ".jps",
        ".pns",
        ".jxl",
        ".jp2",
        ".gif",
        ".psd",
        ".tga",
    ]
)
CAMERA_NAME = re.compile(r"([A-Z0-9_]{4}\d{4}|(IMG|PXL|MVIMG)[_-]\d{8}[_-].*)\.(jpe?g|heic|heif|hif)$", re.IGNORECASE)
"""Names that cameras and phones give (DCF): such pictures are photos, however many there are."""
MADE_OF_ANOTHER = re.compile(rf"(.+?)-({'|'.join(map(re.escape, ('iibr', *EXPORTS)))})(_.*)?")
"""Names, without endings, that this program proposes for what it saves and exports beside a photo."""


FolderOrder = Literal["name", "time"]


@dataclass(frozen=True)
class FolderPhoto:
    """A photo by its name. modified_s: when it was written, seconds since 1970."""

    name: str
    modified_s: float = 0.0


def list_photos(path: str) -> tuple[FolderPhoto, ...]:
    """The photos of a folder, without what belongs to them: maps, pictures saved and exported of them; none where it
    cannot be read.
    """
    found: list[FolderPhoto] = []
    try:
        with os.scandir(path) as entries:
            for entry in entries:
                is_picture = os.path.splitext(entry.name)[1].lower() in PHOTO_ENDINGS
                if is_picture and not entry.name.startswith(".") and entry.is_file():
                    found.append(FolderPhoto(entry.name, entry.stat().st_mtime))
    except OSError:
        return ()
    stems = {os.path.splitext(photo.name)[0] for photo in found}
    return tuple(photo for photo in found if not belongs_to_another(os.path.splitext(photo.name)[0], stems))


def belongs_to_another(stem: str, stems: Container[str]) -> bool:
    """Whether a picture of this name is a map of a photo that has one of these, or was made of it."""
    made = MADE_OF_ANOTHER.fullmatch(stem)
    is_map = any(stem.removesuffix(kind) in stems for kind in SIDECAR_KINDS if stem.endswith(kind))
    return is_map or (made is not None and made[1] in stems)


def first_photo(folder: Path) -> Path | None:
    """What to open of a folder of photos; None where it is a light field, or has no photo.

    Raises InputError where it is a damaged light field.
    """
    photos = in_order(list_photos(str(folder)), "name")
    if not photos:
        return None
    is_of_camera = all(CAMERA_NAME.match(photo.name) for photo in photos)
    return folder / photos[0].name if is_of_camera or find_light_field(folder) is None else None


def in_order(photos: Iterable[FolderPhoto], order: FolderOrder) -> tuple[FolderPhoto, ...]:
    """By name as people count, IMG_9 before IMG_10, or by time."""
    by_name = sorted(photos, key=lambda photo: _counted(photo.name))
    return tuple(by_name if order == "name" else sorted(by_name, key=lambda photo: photo.modified_s))


def _counted(name: str) -> tuple[tuple[int, int, str], ...]:
    """A key that sorts numbers in names by their value."""
    parts = re.split(r"(\d+)", name.casefold())
    return tuple((0, int(part[:18]), "") if part.isdecimal() else (1, 0, part) for part in parts)
