"""What the user may say about an export; each kind heeds some of it, see the registry."""

from __future__ import annotations

from dataclasses import dataclass

from viewer.model.layout import ScreenSize
from viewer.model.state.app_state import LoopKind


@dataclass(frozen=True)
class ExportOptions:
    """None leaves a choice to the kind.

    size: (width, height) of each picture in pixels. device: a display by name, see `DEVICES`. eyes: view steps between
    the two eyes. motion: a loop by name. frames: of one turn, or pictures of a stack. rate: frames a second.
    """

    size: ScreenSize | None = None
    device: str | None = None
    eyes: float | None = None
    motion: LoopKind | None = None
    frames: int | None = None
    rate: float | None = None


USUAL_OPTIONS = ExportOptions()
