"""The map that lies beside a photo, and no map at all.

A name ending in `_depth` holds depth (larger = farther, any unit); every other map is disparity (larger = closer).
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from iibr_core.depth.choice import DepthChoice
from iibr_core.formats.files import is_file
from iibr_core.types import Disparity, ImageSize

SIDECAR_KINDS = ("_disparity", "_depth")
SIDECAR_EXTENSIONS = (".pfm", ".exr", ".npy", ".png")


def find_sidecar(photo_path: Path) -> Path | None:
    """The map beside a photo `name.*`: `name_disparity` before `name_depth`; each as .pfm, .exr, .npy, .png in turn."""
    photo_path = Path(photo_path)
    if not photo_path.name:
        return None
    for kind in SIDECAR_KINDS:
        for extension in SIDECAR_EXTENSIONS:
            candidate = photo_path.with_name(photo_path.stem + kind + extension)
            if is_file(candidate) and candidate != photo_path:
                return candidate
    return None


def map_to_read(photo_path: Path, choice: DepthChoice) -> Path | None:
    """The map that the user names; else the one beside the photo, where the search for depth begins with it."""
    if choice.file is not None:
        return Path(choice.file)
    return find_sidecar(photo_path) if choice.start == "auto" else None


def flat_disparity(size: ImageSize) -> Disparity:
    """Disparity 0 everywhere, for a photo of (height, width) that comes without any."""
    note = (
        "No depth: the photo opens flat. Give a map with --disparity FILE, or put one beside the photo, "
        "named like it with _disparity (.pfm, .exr, .npy, .png) or _depth."
    )
    return Disparity(np.zeros(size, np.float32), "none", (note,))
