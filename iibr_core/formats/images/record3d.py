"""Recordings of Record3D (`.r3d`): a ZIP archive with a JPEG and a map of distances of each frame, and a text in JSON.

The first frame counts as the photo.
"""

import json
import zipfile
from dataclasses import replace
from pathlib import Path
from typing import Any, NamedTuple

from iibr_core.formats.files import MAX_PART_BYTES, parsing, require_file
from iibr_core.formats.images.decode import Header
from iibr_core.formats.images.picture import Picture
from iibr_core.formats.images.pillow_reader import open_with_pillow, orientation_in, picture_of
from iibr_core.types import ImageSize

FRAMES, METADATA = "rgbd/", "metadata"


class Recording(NamedTuple):
    """The first frame. distances: compressed floats, metres, of a map of this size. focal_px: in pixels of the photo's
    stated width. frames: their number.
    """

    photo: bytes
    distances: bytes
    size: ImageSize
    focal_px: float
    width: int
    frames: int


def read_recording(path: Path) -> Recording:
    """Return the first frame of a recording. Raises InputError where the file is damaged or of an unknown layout."""
    require_file(path)
    with parsing(path, "is no recording of Record3D, or damaged ({})"):
        with zipfile.ZipFile(path) as archive:
            numbers = [name.removeprefix(FRAMES).removesuffix(".jpg") for name in archive.namelist()]
            numbers = [name for name in numbers if name.isdecimal()]
            first = FRAMES + min(numbers, key=int)
            stated: Any = json.loads(_part(archive, METADATA))
            photo, distances = _part(archive, f"{first}.jpg"), _part(archive, f"{first}.depth")
        size = ImageSize(int(stated["dh"]), int(stated["dw"]))
        return Recording(photo, distances, size, float(stated["K"][0]), int(stated["w"]), len(numbers))


def recording_header(path: Path) -> Header:
    """Return the header of the first frame's picture."""
    with open_with_pillow(path, ("JPEG",), read_recording(path).photo) as image:
        return Header(ImageSize(image.height, image.width), orientation_in(image.getexif()))


def decode_recording(path: Path) -> Picture:
    """Decode the first frame's picture."""
    recording = read_recording(path)
    with open_with_pillow(path, ("JPEG",), recording.photo) as image:
        picture = picture_of(image)
    focal_px = recording.focal_px * picture.size.width / max(recording.width, 1)
    return replace(picture, focal_px=focal_px)


def _part(archive: zipfile.ZipFile, name: str) -> bytes:
    if archive.getinfo(name).file_size > MAX_PART_BYTES:
        raise ValueError(f"{name} is too large")
    return archive.read(name)
