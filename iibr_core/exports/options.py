"""What the user says about an export."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

from iibr_core.scenes.screen_size import ScreenSize

AnimationKind = Literal["circle", "eight", "swing", "focus", "aperture"]


ANIMATIONS: tuple[AnimationKind, ...] = ("circle", "eight", "swing", "focus", "aperture")
"""What moves: the viewpoint on a loop, or what is sharp from near to far and back, or the aperture."""


@dataclass(frozen=True)
class ExportOptions:
    """None leaves a choice to the kind.

    size: (width, height) of each picture in pixels. device: a display by name, see `DEVICES`. eyes: view steps between
    the two eyes. motion: of an animation. keys: file of a path of one's own. frames: of one turn, or pictures of a
    stack. rate: frames a second. row: of the picture. show: on a display, once it is written.
    budget: bytes that a page may take. credit: whether it names the photo's title, author and rights. stills: whether
    its views are a file each, for browsers that read no frames of moving pictures.
    """

    size: ScreenSize | None = None
    device: str | None = None
    eyes: float | None = None
    motion: AnimationKind | None = None
    keys: Path | None = None
    frames: int | None = None
    rate: float | None = None
    row: int | None = None
    show: bool = False
    budget: int | None = None
    credit: bool = False
    stills: bool = False


USUAL_OPTIONS = ExportOptions()
