"""Records of the viewpoint: a motion, a free camera, and the visible part of the picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from iibr_core.beyond.optics import CENTRE
from iibr_core.exports.loops import LoopKind
from iibr_core.types import ViewOffset

MotionKind = LoopKind | Literal["home", "rack"]
"""home: a glide to the middle. rack: a glide of the focus from one surface to another."""

MAX_ASIDE = 0.3
"""Largest turn of the free camera to each side, in halves of the picture: 15 % of the view lies beyond the photo."""
FORWARD_LIMITS = -0.1, 0.6
"""Farthest step of the free camera back and forward, in distances of the nearest surface."""


@dataclass(frozen=True)
class Motion:
    """A viewpoint that moves by itself.

    kind: None at rest. turns: progress on the path since it began at the viewpoint `start` (and its dolly). rack: first
    and last focus disparity of a rack. ticked_s: clock at the last step, None before the first. speed: turns per
    second; it and is_paused outlast a change of kind.
    """

    kind: MotionKind | None = None
    turns: float = 0.0
    ticked_s: float | None = None
    start: ViewOffset = CENTRE
    start_dolly: float = 0.0
    rack: tuple[float, float] = (0.0, 0.0)
    speed: float = 0.25
    is_paused: bool = False

    @property
    def is_running(self) -> bool:
        """Whether the picture changes without input."""
        return self.kind is not None and not self.is_paused


@dataclass(frozen=True)
class FreeCamera:
    """Pose of the camera, relative to the photo's.

    right, down: the turn; 1 looks at what was at the picture's border. forward: in distances of the nearest surface.
    """

    right: float = 0.0
    down: float = 0.0
    forward: float = 0.0

    @property
    def is_at_end(self) -> bool:
        """Whether the camera has reached a limit."""
        return max(abs(self.right), abs(self.down)) >= MAX_ASIDE or self.forward in FORWARD_LIMITS


@dataclass(frozen=True)
class Zoom:
    """A visible part of the picture.

    scale: pixels of the screen per pixel of the photo at its own size. centre: the point of the picture, (x, y) from 0
    to 1, that lies in the middle of the available space, as far as the picture fills that.
    """

    scale: float
    centre: tuple[float, float] = (0.5, 0.5)


@dataclass(frozen=True)
class Tracking:
    """A viewpoint that follows the head. Places are right + 1j * down, in cm.

    address: where packets arrive, as `udp:HOST:PORT`. head: its newest place; centre: the place for the photo's own
    viewpoint; None before the first. eye: viewpoint that the head led to last. latency_ms: from packets to pictures on
    the screen. is_receiving: whether poses arrive.
    """

    address: str
    head: complex | None = None
    centre: complex | None = None
    eye: ViewOffset = CENTRE
    latency_ms: float = 0.0
    is_receiving: bool = True
