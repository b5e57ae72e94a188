"""A camera that leaves the plane of the views: it looks around and steps forward, within fixed limits."""

from __future__ import annotations

import math
from dataclasses import dataclass

from iibr_core.scenes.lens_limits import clamp

MAX_ASIDE = 0.3
"""Largest turn to each side, in halves of the picture: at most 15 % of the view lies beyond the photo."""
FORWARD_LIMITS = -0.1, 0.6
"""Farthest step back and forward, in distances of the nearest surface."""


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
class MoveCamera:
    """Look farther aside, and step forward, from where the camera is; see `FreeCamera`."""

    right: float = 0.0
    down: float = 0.0
    forward: float = 0.0


@dataclass(frozen=True)
class LeaveCamera:
    """Back to the plane of the views."""


@dataclass(frozen=True)
class CameraProgress:
    """How much is done of what a photo's free views are made of; None when it is there."""

    done: float | None


FreeCameraAction = MoveCamera | LeaveCamera | CameraProgress


def moved(camera: FreeCamera, action: MoveCamera) -> FreeCamera:
    """Return the moved camera within its limits; the same camera if a number is not finite."""
    right, down, forward = camera.right + action.right, camera.down + action.down, camera.forward + action.forward
    if not all(map(math.isfinite, (right, down, forward))):
        return camera
    right, down = (clamp(turn, -MAX_ASIDE, MAX_ASIDE) for turn in (right, down))
    return FreeCamera(right, down, clamp(forward, *FORWARD_LIMITS))
