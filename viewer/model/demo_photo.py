"""Photos that lie in folders of the program: the demo, and pasted pictures."""

from __future__ import annotations

from pathlib import Path, PurePath

from iibr_core.runtime.resources import resource_folder

PASTED_FOLDER = "pasted"
"""Name of the folder that keeps pasted pictures for a while; nothing else is saved there."""


def demo_photo() -> Path:
    """Return the path of the demo; its disparity map lies beside it."""
    return resource_folder("assets") / "motorcycle" / "motorcycle.png"


def is_ours(path: str) -> bool:
    """Return whether a photo lies in a folder of the program, where the user keeps nothing."""
    folder = PurePath(path).parent
    return folder.name == PASTED_FOLDER or folder.is_relative_to(resource_folder("assets"))
