"""A camera that leaves the plane of the views: it looks around, steps forward, stands at a pose from a file."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from iibr_core.types import Camera

MOST_ASIDE = 0.6
"""Of half the picture: farther aside most would be made up."""
FORWARD_LIMITS = -0.4, 0.6
"""In distances of the nearest."""


@dataclass(frozen=True, eq=False)
class Poses:
    """Cameras from a file. given: index of the one that took the photo. file: where they stand, "" for nowhere."""

    cameras: tuple[Camera, ...]
    given: int
    file: str = ""


@dataclass(frozen=True)
class FreeCamera:
    """pose: index among the poses, None for the photo's own place. right, down: where it looks, 1 is the place where
    the picture's border was. forward: in distances of the nearest.
    """

    pose: int | None = None
    right: float = 0.0
    down: float = 0.0
    forward: float = 0.0


@dataclass(frozen=True)
class MoveCamera:
    """Look farther aside, and step forward, from where the camera is; see `FreeCamera`."""

    right: float = 0.0
    down: float = 0.0
    forward: float = 0.0


@dataclass(frozen=True)
class StepPose:
    """Stand at the pose so many further on."""

    steps: int


@dataclass(frozen=True)
class LeaveCamera:
    """Back to the plane of the views."""


@dataclass(frozen=True)
class CameraProgress:
    """How much is done of what a photo's free views are made of; None when it is there."""

    done: float | None


FreeCameraAction = MoveCamera | StepPose | LeaveCamera | CameraProgress


def moved(camera: FreeCamera, action: MoveCamera) -> FreeCamera:
    """The camera within its limits; as it was where the numbers are not finite."""
    right, down, forward = camera.right + action.right, camera.down + action.down, camera.forward + action.forward
    if not all(map(math.isfinite, (right, down, forward))):
        return camera
    right, down = (min(max(aside, -MOST_ASIDE), MOST_ASIDE) for aside in (right, down))
    return replace(camera, right=right, down=down, forward=min(max(forward, FORWARD_LIMITS[0]), FORWARD_LIMITS[1]))


def stepped(camera: FreeCamera, poses: Poses, steps: int) -> FreeCamera:
    """At the next pose, looking as it does; the first one after the photo's own comes first."""
    before = poses.given if camera.pose is None else camera.pose
    return FreeCamera((before + steps) % len(poses.cameras))
