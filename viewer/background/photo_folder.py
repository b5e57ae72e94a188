"""Which photos lie in a folder, and whether a folder is one of photos rather than a light field."""

from __future__ import annotations

import os
import re
from collections.abc import Container
from pathlib import Path

from iibr_core.depth.sidecar import SIDECAR_KINDS
from iibr_core.formats.light_fields.registry import find_light_field
from viewer.model.export_kinds import EXPORTS
from viewer.model.reducers.folder import in_order
from viewer.model.state.folder import FolderListed, FolderPhoto

PHOTO_ENDINGS = frozenset(
    (
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
    )
)
CAMERA_NAME = re.compile(r"([A-Z0-9_]{4}\d{4}|(IMG|PXL|MVIMG)[_-]\d{8}[_-].*)\.(jpe?g|heic|heif|hif)$", re.IGNORECASE)
"""Names that cameras and phones give (DCF): such pictures are photos, however many there are."""
MADE_OF_ANOTHER = re.compile(rf"(.+?)-({'|'.join(map(re.escape, ('iibr', *EXPORTS)))})(_.*)?")
"""Names, without endings, that this program proposes for what it saves and exports beside a photo."""


def list_photos(path: str) -> FolderListed:
    """The photos of a folder, without what belongs to them: maps, pictures saved and exported of them; none where it
    cannot be read.
    """
    found: list[FolderPhoto] = []
    try:
        with os.scandir(path) as entries:
            for entry in entries:
                stem, ending = os.path.splitext(entry.name)
                is_photo = ending.lower() in PHOTO_ENDINGS and not stem.endswith(SIDECAR_KINDS)
                if is_photo and not entry.name.startswith(".") and entry.is_file():
                    found.append(FolderPhoto(entry.name, entry.stat().st_mtime))
    except OSError:
        return FolderListed(path, ())
    stems = {os.path.splitext(photo.name)[0] for photo in found}
    return FolderListed(
        path, tuple(photo for photo in found if not _is_made_of(os.path.splitext(photo.name)[0], stems))
    )


def _is_made_of(stem: str, stems: Container[str]) -> bool:
    """Whether a picture of this name is made of a photo that has one of these."""
    made = MADE_OF_ANOTHER.fullmatch(stem)
    return made is not None and made[1] in stems


def first_photo(folder: Path) -> Path | None:
    """What to open of a folder of photos; None where it is a light field, or has no photo.

    Raises InputError where it is a damaged light field.
    """
    photos = in_order(list_photos(str(folder)).photos, "name")
    if not photos:
        return None
    is_of_camera = all(CAMERA_NAME.match(photo.name) for photo in photos)
    return folder / photos[0].name if is_of_camera or find_light_field(folder) is None else None
