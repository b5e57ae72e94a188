"""The photo that comes with the program."""

from __future__ import annotations

from pathlib import Path

from iibr_core.runtime.resources import resource_folder


def demo_photo() -> Path:
    """Return its path; its disparity map lies beside it."""
    return resource_folder("assets") / "motorcycle" / "motorcycle.png"
