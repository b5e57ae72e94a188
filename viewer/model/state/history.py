"""Records of undo and redo."""

from __future__ import annotations

from dataclasses import dataclass

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.scene import AS_FOUND, DepthSettings


@dataclass(frozen=True)
class Edit:
    """The part of the state that undo restores."""

    optics: Optics
    depth_strength: float
    depth: DepthSettings = AS_FOUND


@dataclass(frozen=True)
class History:
    """Edits to undo (the latest last) and to redo (the next first), in the units of the open scene.

    last: kind of the latest edit. gesture: that kind while its gesture lasts, "" after: more edits of this kind
    belong to it until the pointer goes down or up.
    """

    past: tuple[Edit, ...] = ()
    future: tuple[Edit, ...] = ()
    last: str = ""
    gesture: str = ""
