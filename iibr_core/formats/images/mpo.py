"""Multi-picture JPEGs (CIPA DC-007), as stereo cameras write them: the left eye's picture, then the right eye's."""

from __future__ import annotations

from pathlib import Path

from iibr_core.formats.files import open_binary
from iibr_core.formats.images.pillow_reader import open_with_pillow
from iibr_core.types import InputError

JPEG_START = b"\xff\xd8\xff"
MPO = ("JPEG",), "a multi-picture JPEG"
"""Arguments of `open_with_pillow`; Pillow opens both kinds of JPEG by that name."""
ENTRIES_TAG = 0xB002
MPO_ENDING = ".mpo"
"""Ending of files whose pictures are for two eyes, even where the camera does not state their purpose."""


def is_jpeg(path: Path) -> bool:
    """Return whether a file begins as JPEGs do."""
    with open_binary(path) as file:
        return file.read(len(JPEG_START)) == JPEG_START


def is_stereo_mpo(path: Path) -> bool:
    """Return whether a JPEG holds pictures for several eyes, rather than its gain map or a larger preview.

    Raises InputError only for one that ends in .mpo, and is damaged or holds a single picture.
    """
    is_named = path.suffix.lower() == MPO_ENDING
    try:
        with open_with_pillow(path, *MPO) as image:
            count = getattr(image, "n_frames", 1)
            entries = getattr(image, "mpinfo", {}).get(ENTRIES_TAG, ())
            is_disparity = any("Disparity" in str(entry.get("Attribute", {}).get("MPType")) for entry in entries)
    except InputError:
        if is_named:
            raise
        return False
    if is_named and count < 2:
        raise InputError(f"{path}: holds one picture only, not one for each eye; get the whole file again")
    return count >= 2 and (is_named or is_disparity)
