"""A viewpoint that moves by itself. `viewer.model.reducers.camera_motion` says along which path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from iibr_core.exports import LoopKind
from iibr_core.rendering import CENTRE
from iibr_core.types import ViewOffset

MotionKind = LoopKind | Literal["home", "sway"]
"""home: a glide to the middle. sway: slow and small, for a while, as long as nobody touches anything."""


@dataclass(frozen=True)
class Motion:
    """How it moves.

    kind: None at rest. turns: of the path since it began at the viewpoint `start` (and its dolly). ticked_s: clock of
    the last step, None before the first. speed, in turns per second, and is_paused outlast a change of kind.
    """

    kind: MotionKind | None = None
    turns: float = 0.0
    ticked_s: float | None = None
    start: ViewOffset = CENTRE
    start_dolly: float = 0.0
    speed: float = 0.25
    is_paused: bool = False

    @property
    def is_running(self) -> bool:
        """Whether the picture changes without anybody touching it."""
        return self.kind is not None and not self.is_paused
