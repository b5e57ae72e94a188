"""Photos of a folder, and whether a folder holds photos rather than a light field."""

import os
import re
from collections.abc import Container, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from iibr_core.exports.kinds import EXPORTS
from iibr_core.formats.files import natural_key
from iibr_core.formats.light_fields.light_field_formats import find_light_field
from iibr_core.formats.maps.map_names import FOLDER_OF_MAPS, FOLDER_OF_PHOTOS, map_name, photo_keys

PHOTO_ENDINGS = (
    ".jpg", ".jpeg", ".png", ".tif", ".tiff", ".exr", ".hdr", ".webp", ".bmp", ".heic", ".heif", ".hif", ".avif",
    ".mpo", ".lif", ".jps", ".pns", ".jxl", ".jp2", ".gif", ".psd", ".tga",
)  # fmt: skip
CAMERA_NAME = re.compile(r"([A-Z0-9_]{4}\d{4}|(IMG|PXL|MVIMG)[_-]\d{8}[_-].*)\.(jpe?g|heic|heif|hif)$", re.IGNORECASE)
"""Names from cameras and phones (DCF): these pictures are photos, never the views of a light field."""
DERIVED_NAME = re.compile(rf"(.+?)-({'|'.join(map(re.escape, ('iibr', *EXPORTS)))})(_.*)?")
"""Names, without endings, that this program proposes for pictures saved and exported beside a photo."""
FolderOrder = Literal["name", "time"]


@dataclass(frozen=True)
class FolderPhoto:
    """A photo in a folder. modified_s: time of its last change, seconds since 1970."""

    name: str
    modified_s: float = 0.0


def list_photos(path: str) -> tuple[FolderPhoto, ...]:
    """Return the photos of a folder without their maps and exports; none if the folder cannot be read."""
    photos: list[FolderPhoto] = []
    try:
        with os.scandir(path) as entries:
            for entry in entries:
                is_picture = os.path.splitext(entry.name)[1].lower() in PHOTO_ENDINGS
                if is_picture and not entry.name.startswith(".") and entry.is_file():
                    photos.append(FolderPhoto(entry.name, entry.stat().st_mtime))
    except OSError:
        return ()
    stems = {os.path.splitext(photo.name)[0] for photo in photos}
    keys = {key for stem in stems if map_name(stem) is None for key in photo_keys(stem)}
    return tuple(photo for photo in photos if not belongs_to_another(os.path.splitext(photo.name)[0], stems, keys))


def belongs_to_another(stem: str, stems: Container[str], keys: Container[str]) -> bool:
    """Return whether a picture with this stem is an export of a photo with one of the stems, or its map by the keys."""
    derived, said = DERIVED_NAME.fullmatch(stem), map_name(stem)
    return (said is not None and said.key in keys) or (derived is not None and derived[1] in stems)


def without_maps(folders: Iterable[str], has_photos: bool) -> list[str]:
    """Return names of folders, sorted, without hidden ones and those of the maps of photos beside them."""
    shown = sorted(name for name in folders if not name.startswith("."))
    if has_photos or any(map(FOLDER_OF_PHOTOS.fullmatch, shown)):
        shown = [name for name in shown if not FOLDER_OF_MAPS.fullmatch(name)]
    return shown


def middle_picture(path: Path) -> Path:
    """Return the middle picture of a light field's folder; the path itself if it is no folder or has no pictures."""
    pictures = in_order(list_photos(str(path)), "name") if path.is_dir() else ()
    return path / pictures[len(pictures) // 2].name if pictures else path


def first_photo(folder: Path) -> Path | None:
    """Return the first photo of a folder, None if the folder is a light field or has no photo."""
    photos = in_order(list_photos(str(folder)), "name")
    if not photos:
        return None
    is_of_camera = all(CAMERA_NAME.match(photo.name) for photo in photos)
    return folder / photos[0].name if is_of_camera or find_light_field(folder) is None else None


def in_order(photos: Iterable[FolderPhoto], order: FolderOrder) -> tuple[FolderPhoto, ...]:
    """Return photos by time, or by name with numbers in their natural order: IMG_9 before IMG_10."""
    by_name = sorted(photos, key=lambda photo: natural_key(Path(photo.name)))
    return tuple(by_name if order == "name" else sorted(by_name, key=lambda photo: photo.modified_s))
