"""Multi-picture JPEGs (CIPA DC-007), as stereo cameras write them, and Leia images: JPEGs with further pictures.

A Leia image is a JPEG of the first view, followed by a region of numbered fields: the other views' pictures, maps of
inverse depth, and JSON that describes them. Leia publishes readers, not a description; this follows them, versions 5.1
to 5.3, and files of the Lume Pad 2. The last bytes of the file hold the size of the region. All numbers are big-endian.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from iibr_core.formats.files import parsing, printable, read_bytes
from iibr_core.formats.images.pillow_reader import open_with_pillow
from iibr_core.types import InputError

ENTRIES_TAG = 0xB002
MPO_ENDING = ".mpo"
"""Ending of files whose pictures are for two eyes, even where the camera does not state their purpose."""
END_MARK = b"\x1e\x1a"
TRAILER_BYTES = 6
JSON_FIELDS = (8, 7)
SOURCE_IMAGE = -1
"""Number that stands for the file's first JPEG among the fields."""
LIF_ENDING = ".lif"
NAMES = {"albedo": "image", "disparity": "inv_z_map", "inv_z_dist": "inv_z_map"}
"""Today's names of properties by those of older versions."""
ADVICE = "save it side by side with Leia's program, under a name that ends in '_2x1', or get the camera's file"
"""End of errors about files that are whole, but of an unknown version."""


@dataclass(frozen=True)
class LifView:
    """A view in a Leia image.

    image: field of its picture. inverse_depth: field of its map (white is near), None without. x: place of its camera,
    positive to the right.
    """

    image: int
    inverse_depth: int | None
    x: float


@dataclass(frozen=True, eq=False)
class Lif:
    """Contents of a Leia image. fields: contents by number. views: from left to right."""

    fields: Mapping[int, bytes]
    views: tuple[LifView, ...]


def read_lif(data: bytes, name: object) -> Lif | None:
    """Return the contents of a file's bytes; None where they are no Leia image. name: the file's, for messages."""
    region, end = int.from_bytes(data[-TRAILER_BYTES:-2], "big"), len(data) - TRAILER_BYTES
    if not (data.endswith(END_MARK) and TRAILER_BYTES < region <= len(data)):
        return None  # a JPEG may end in any two bytes
    fields = _fields(data[len(data) - region : end])
    described = next((fields[number] for number in JSON_FIELDS if number in fields), None)
    if described is None:
        raise InputError(f"{name}: its Leia fields ({printable(str(list(fields)))}) describe no views; {ADVICE}")
    with parsing(name, "damaged (its Leia fields hold no JSON: {}); get the whole file again"):
        parsed = json.loads(described)
    with parsing(name, f"describes its views in an unknown way ({{}}); {ADVICE}"):
        views = [_view(entry) for entry in parsed["views"]]
    pictures = {number for view in views for number in (view.image, view.inverse_depth) if number is not None}
    missing = sorted(pictures - {SOURCE_IMAGE, *fields})
    if missing or not views:
        lacks = f"lack the pictures {printable(str(missing))}, which they name" if missing else "list no views"
        raise InputError(f"{name}: its Leia fields {lacks}; {ADVICE}")
    return Lif(fields, tuple(sorted(views, key=lambda view: view.x)))


def open_lif(path: Path) -> Lif | None:
    """Return the contents of a Leia image, None for other files, whose names must not end in .lif."""
    lif = read_lif(read_bytes(path), path)
    if lif is None and path.suffix.lower() == LIF_ENDING:
        raise InputError(f"{path}: damaged or cut off (no Leia fields at its end); get the whole file again")
    return lif


def lif_bytes(path: Path, number: int) -> bytes:
    """Return the content of a field."""
    lif = open_lif(path)
    if lif is None or number not in lif.fields:
        raise InputError(f"{path}: no longer has a picture {number}; open it again")
    return lif.fields[number]


def _fields(region: bytes) -> dict[int, bytes]:
    """Return the fields by number; of several with one number the first counts."""
    fields: dict[int, bytes] = {}
    count, at = int.from_bytes(region[:4], "big"), 4
    for _ in range(count):
        number, length = (int.from_bytes(region[k : k + 4], "big") for k in (at, at + 4))
        at += 8
        if at + length > len(region):
            raise InputError("damaged or cut off (a Leia field goes beyond its end); get the whole file again")
        fields.setdefault(number, region[at : at + length])
        at += length
    return fields


def _view(entry: Mapping[str, Any]) -> LifView:
    if "albedoId" in entry:  # Lume Pad 2, where 0 stands for no map
        depth_field = int(entry.get("disparityId") or entry.get("monodisparityId") or 0)
        return LifView(int(entry["albedoId"]), depth_field or None, float(entry.get("xLocation", 0.0)))
    entry = {NAMES.get(key, key): value for key, value in entry.items()}
    inverse_depth = entry.get("inv_z_map")
    position = entry.get("position", entry.get("camera_data", {}).get("position", 0.0))
    if isinstance(position, dict):
        position = position.get("x", 0.0)
    x = position[0] if isinstance(position, list) else position
    return LifView(int(entry["image"]["blob_id"]), inverse_depth and int(inverse_depth["blob_id"]), float(x))


def is_stereo_mpo(path: Path) -> bool:
    """Return whether a JPEG holds pictures for several eyes, rather than its gain map or a larger preview.

    Raises InputError only for one that ends in .mpo, and is damaged or holds a single picture.
    """
    is_named = path.suffix.lower() == MPO_ENDING
    try:
        with open_with_pillow(path, ("JPEG",)) as image:
            count = getattr(image, "n_frames", 1)
            entries = getattr(image, "mpinfo", {}).get(ENTRIES_TAG, ())
            is_disparity = any("Disparity" in str(entry.get("Attribute", {}).get("MPType")) for entry in entries)
    except InputError:
        if is_named:
            raise
        return False
    if is_named and count < 2:
        raise InputError(
            f"{path}: holds one picture only, not one for each eye; get the camera's file, or rename it to .jpg"
        )
    return count >= 2 and (is_named or is_disparity)
