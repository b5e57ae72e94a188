"""Find the shaders, assets and pages that come with the program, in a checkout and in an installed copy alike."""

from __future__ import annotations

from pathlib import Path


def resource_folder(name: str) -> Path:
    """Return the folder "shaders", "assets" or "web". Raises FileNotFoundError if the installation lacks it."""
    here = Path(__file__).resolve().parents[1]
    for folder in (here / "_resources" / name, here.parent / name):
        if folder.is_dir():
            return folder
    raise FileNotFoundError(f"{name}/ is missing beside {here}: reinstall iibr")
