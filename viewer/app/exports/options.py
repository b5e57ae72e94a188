"""What the user may say about an export; each kind heeds some of it, see the registry."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from viewer.model.layout import ScreenSize
from viewer.model.state.app_state import LOOPS

AnimationKind = Literal["circle", "eight", "swing", "focus", "aperture"]
ANIMATIONS: tuple[AnimationKind, ...] = (*LOOPS, "focus", "aperture")
"""What moves: the viewpoint on a loop, or what is sharp from near to far and back, or the aperture."""


@dataclass(frozen=True)
class ExportOptions:
    """None leaves a choice to the kind.

    size: (width, height) of each picture in pixels. device: a display by name, see `DEVICES`. eyes: view steps between
    the two eyes. motion: of an animation. keys: file of a path of one's own. frames: of one turn, or pictures of a
    stack. rate: frames a second.
    """

    size: ScreenSize | None = None
    device: str | None = None
    eyes: float | None = None
    motion: AnimationKind | None = None
    keys: Path | None = None
    frames: int | None = None
    rate: float | None = None


USUAL_OPTIONS = ExportOptions()
