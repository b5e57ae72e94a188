"""Leia Image Format: a JPEG of the first view, followed by a region of numbered fields: the other views' pictures, maps
of inverse depth, and JSON that says what is what.

Leia publishes readers, not a description: as those have it, versions 5.1 to 5.3. The region's size stands in the file's
last bytes, big-endian as all its numbers.
"""

from __future__ import annotations

import json
import struct
from collections.abc import Mapping
from dataclasses import dataclass
from io import SEEK_END
from pathlib import Path
from typing import Any, BinaryIO

from iibr_core.formats.files import open_binary
from iibr_core.formats.images.oiio_reader import Raster
from iibr_core.formats.images.pillow_reader import open_with_pillow, raster_of
from iibr_core.types import ImageSize, InputError

END_MARK = b"\x1e\x1a"
TRAILER_BYTES = 6
JSON_FIELDS = (8, 7)
MOST_FIELDS, MOST_JSON_BYTES = 1000, 1 << 24
SOURCE_IMAGE = -1
"""The number of the file's own JPEG among the fields."""
OWN_ENDING = ".lif"
PICTURE = ("JPEG", "PNG", "WEBP"), "a picture in a Leia image"
NAMES = {"albedo": "image", "disparity": "inv_z_map", "inv_z_dist": "inv_z_map"}
"""Of older versions, and what they are called since."""


@dataclass(frozen=True)
class LifView:
    """image: the field of its picture. inverse_depth: the field of its map (white is near), None without.

    x: where its camera stands, to the right.
    """

    image: int
    inverse_depth: int | None
    x: float


@dataclass(frozen=True)
class Lif:
    """fields: first byte and length of each by its number. views: from left to right."""

    fields: Mapping[int, tuple[int, int]]
    views: tuple[LifView, ...]


def read_lif(file: BinaryIO) -> Lif | None:
    """What a file that is open holds as a Leia image, None where it is none. Raises InputError where it is damaged."""
    end = file.seek(0, SEEK_END)
    file.seek(max(end - TRAILER_BYTES, 0))
    trailer = file.read(TRAILER_BYTES)
    if len(trailer) < TRAILER_BYTES or not trailer.endswith(END_MARK):
        return None
    region = int.from_bytes(trailer[:4], "big")
    if not TRAILER_BYTES < region <= end:
        return None  # a JPEG may end in any two bytes
    fields = _fields(file, end - region, end - TRAILER_BYTES)
    said = next((fields[number] for number in JSON_FIELDS if number in fields), None)
    if said is None:
        raise InputError("its Leia fields say nothing of views; get the whole file again")
    first, length = said
    file.seek(first)
    return Lif(fields, _views(file.read(min(length, MOST_JSON_BYTES)), fields))


def open_lif(path: Path) -> Lif | None:
    """Of a file. Raises InputError as `read_lif`, and for one that ends in .lif and is none."""
    with open_binary(path) as file:
        try:
            found = read_lif(file)
        except InputError as error:
            raise InputError(f"{path}: {error}") from error
    if found is None and path.suffix.lower() == OWN_ENDING:
        raise InputError(f"{path}: damaged or cut off (no Leia fields at its end); get the whole file again")
    return found


def read_lif_picture(path: Path, number: int) -> Raster:
    """Decode the picture in a field. Raises InputError where there is none, or it is damaged."""
    with open_with_pillow(path, *PICTURE, lif_bytes(path, number)) as image:
        return raster_of(image)


def lif_picture_size(path: Path, number: int) -> ImageSize:
    """As stored. Raises InputError as `read_lif_picture` does."""
    with open_with_pillow(path, *PICTURE, lif_bytes(path, number)) as image:
        return ImageSize(image.height, image.width)


def lif_bytes(path: Path, number: int) -> bytes:
    """What a field holds. Raises InputError where there is no such."""
    found = open_lif(path)
    if found is None or number not in found.fields:
        raise InputError(f"{path}: has no picture {number}; get the whole file again")
    first, length = found.fields[number]
    with open_binary(path) as file:
        file.seek(first)
        return file.read(length)


def _fields(file: BinaryIO, first: int, end: int) -> dict[int, tuple[int, int]]:
    """By their numbers; the first of each counts."""
    fields: dict[int, tuple[int, int]] = {}
    file.seek(first)
    count, at = int.from_bytes(file.read(4), "big"), first + 4
    if count > MOST_FIELDS:
        raise InputError(f"claims {count:,} Leia fields; get the whole file again")
    for _ in range(count):
        file.seek(at)
        header = file.read(8)
        number, length = struct.unpack(">II", header) if len(header) == 8 else (0, end)
        if at + 8 + length > end:
            raise InputError("damaged or cut off (a Leia field goes beyond its end); get the whole file again")
        fields.setdefault(number, (at + 8, length))
        at += 8 + length
    return fields


def _views(text: bytes, fields: Mapping[int, Any]) -> tuple[LifView, ...]:
    try:
        said = json.loads(text)
        views = [_view({NAMES.get(key, key): value for key, value in view.items()}) for view in said["views"]]
    except (ValueError, KeyError, TypeError, AttributeError, IndexError, OverflowError, RecursionError) as error:
        raise InputError(
            f"its Leia fields cannot be read ({type(error).__name__}); get the whole file again"
        ) from error
    wanted = {number for view in views for number in (view.image, view.inverse_depth) if number is not None}
    if not views or not wanted <= {SOURCE_IMAGE, *fields}:
        raise InputError("its Leia fields lack a picture that they name; get the whole file again")
    return tuple(sorted(views, key=lambda view: view.x))


def _view(said: Mapping[str, Any]) -> LifView:
    inverse_depth = said.get("inv_z_map")
    position = said.get("position", said.get("camera_data", {}).get("position", 0.0))
    x = (
        position.get("x", 0.0)
        if isinstance(position, dict)
        else position[0]
        if isinstance(position, list)
        else position
    )
    return LifView(
        int(said["image"]["blob_id"]), None if inverse_depth is None else int(inverse_depth["blob_id"]), float(x)
    )
