"""The map that lies beside a photo, and no map at all.

A name ending in `_depth` holds depth, every other map disparity; what their numbers mean is seen in them.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from iibr_core.depth.choice import DepthChoice
from iibr_core.formats.files import is_file
from iibr_core.types import Disparity, ImageSize

SIDECAR_KINDS = ("_disparity", "_depth")
SIDECAR_EXTENSIONS = (".pfm", ".exr", ".npy", ".npz", ".tif", ".tiff", ".png", ".webp", ".jpg", ".jpeg")


def find_sidecar(photo_path: Path) -> Path | None:
    """The map beside a photo `name.*`: `name_disparity` before `name_depth`, each as one of the kinds
    above, in turn.
    """
    found = sidecars_of(photo_path)
    return found[0] if found else None


def sidecars_of(photo_path: Path) -> list[Path]:
    """All maps beside a photo, in the order of `find_sidecar`."""
    photo_path = Path(photo_path)
    if not photo_path.name:
        return []
    names = [photo_path.stem + kind + extension for kind in SIDECAR_KINDS for extension in SIDECAR_EXTENSIONS]
    candidates = [photo_path.with_name(name) for name in names]
    return [candidate for candidate in candidates if candidate != photo_path and is_file(candidate)]


def map_to_read(photo_path: Path, choice: DepthChoice) -> Path | None:
    """The map that the user names; else the one beside the photo, where the search for depth begins with it."""
    if choice.file is not None:
        return Path(choice.file)
    return find_sidecar(photo_path) if choice.start == "auto" else None


def flat_disparity(size: ImageSize) -> Disparity:
    """Disparity 0 everywhere, for a photo of (height, width) that comes without any."""
    note = (
        "No depth: the photo opens flat. Give a map with --disparity FILE, or put one beside the photo, "
        "named like it with _depth or _disparity, as a picture (white is near), .pfm, .exr, .tif, .npy or .npz."
    )
    return Disparity(np.zeros(size, np.float32), "none", (note,))
