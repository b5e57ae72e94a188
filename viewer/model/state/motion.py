"""A viewpoint that moves by itself. `viewer.model.reducers.camera_motion` says along which path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from iibr_core.beyond.optics import CENTRE
from iibr_core.exports.loops import LoopKind
from iibr_core.types import ViewOffset

MotionKind = LoopKind | Literal["home"]
"""home: a glide to the middle."""


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


@dataclass(frozen=True)
class ReturnHome:
    """Glide back to the middle viewpoint. takes_back_click: by a double click, whose first click set the focus."""

    takes_back_click: bool = False


@dataclass(frozen=True)
class SetLoop:
    """Move the viewpoint along this path, over and over; None stops it where it is."""

    kind: LoopKind | None


@dataclass(frozen=True)
class SetSpeed:
    """Speed of loops, turns per second."""

    turns_per_second: float


@dataclass(frozen=True)
class PauseMotion:
    """Hold the motion, or let it go on."""

    is_paused: bool


@dataclass(frozen=True)
class Tick:
    """The clock shows this many seconds: a motion goes on."""

    now_s: float


MotionAction = ReturnHome | SetLoop | SetSpeed | PauseMotion | Tick
