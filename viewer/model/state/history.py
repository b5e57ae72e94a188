"""Records of undo and redo."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.scene import AS_FOUND, DepthSettings


@dataclass(frozen=True)
class Edit:
    """What undo brings back."""

    optics: Optics
    depth_strength: float
    depth: DepthSettings = AS_FOUND


@dataclass(frozen=True)
class History:
    """Edits to go back to (the latest last) and forth to (the nearest first), in the units of the open scene.

    last: the kind of the latest edit. gesture: that kind too while it is under way, "" after: more of the same belongs
    to it until the pointer goes down or up.
    """

    past: tuple[Edit, ...] = ()
    future: tuple[Edit, ...] = ()
    last: str = ""
    gesture: str = ""
