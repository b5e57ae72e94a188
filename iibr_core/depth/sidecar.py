"""Maps beside a photo: `NAME_disparity.*` and `NAME_depth.*`."""

from __future__ import annotations

from pathlib import Path

from iibr_core.depth.choice import DepthChoice

SIDECAR_KINDS = ("_disparity", "_depth")
SIDECAR_EXTENSIONS = (".pfm", ".exr", ".npy", ".npz", ".tif", ".tiff", ".png", ".webp", ".jpg", ".jpeg")


def find_sidecars(photo_path: Path) -> list[Path]:
    """Return all maps beside a photo, the best first."""
    if not photo_path.name:
        return []
    names = [photo_path.stem + kind + extension for kind in SIDECAR_KINDS for extension in SIDECAR_EXTENSIONS]
    candidates = [photo_path.with_name(name) for name in names]
    return [candidate for candidate in candidates if candidate != photo_path and candidate.is_file()]


def map_to_read(photo_path: Path, choice: DepthChoice) -> Path | None:
    """Return the map that the user names, else the one beside the photo if the search for depth begins there."""
    if choice.file is not None:
        return Path(choice.file)
    return next(iter(find_sidecars(photo_path)), None) if choice.start == "auto" else None
