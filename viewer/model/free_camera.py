"""A camera that leaves the plane of the views: it looks around, steps forward, stands at a pose from a file."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

from iibr_core.types import Camera

MOST_ASIDE = 0.6
"""Of half the picture."""
FORWARD_LIMITS = -0.4, 0.6
"""In distances of the nearest."""
LEAST_SEEN = 0.85
"""Of the camera's picture must lie within the photo's frame: it stops where more would be synthesised."""
END_SLACK = 1e-3
STOP_STEPS = 20
"""Halvings of a step, to find where it stops."""


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


def seen_share(camera: FreeCamera, depth: float) -> float:
    """How much of the camera's picture lies within the photo's frame, where what it looks at is so far from the photo
    (in distances of the nearest); relative to its pose. The turn counts as a shift of the picture.
    """
    reach = (depth - camera.forward) / depth
    shares = 1.0
    for aside in (camera.right, camera.down):
        low, high = (aside - 1) * reach, (aside + 1) * reach
        shares *= max(min(high, 1.0) - max(low, -1.0), 0.0) / (high - low)
    return shares


def is_at_end(camera: FreeCamera, depth: float) -> bool:
    """Whether the camera can go no farther one way: there the photo, or what is near, ends."""
    asides = max(abs(camera.right), abs(camera.down))
    is_limit = asides >= MOST_ASIDE or camera.forward in FORWARD_LIMITS
    return is_limit or seen_share(camera, depth) < LEAST_SEEN + END_SLACK


def moved(camera: FreeCamera, action: MoveCamera, depth: float) -> FreeCamera:
    """The camera within its limits, see `seen_share`; as it was where the numbers are not finite."""
    right, down, forward = camera.right + action.right, camera.down + action.down, camera.forward + action.forward
    if not all(map(math.isfinite, (right, down, forward))):
        return camera
    right, down = (min(max(aside, -MOST_ASIDE), MOST_ASIDE) for aside in (right, down))
    there = replace(camera, right=right, down=down, forward=min(max(forward, FORWARD_LIMITS[0]), FORWARD_LIMITS[1]))
    if seen_share(there, depth) >= min(LEAST_SEEN, seen_share(camera, depth)):
        return there
    inside, beyond = 0.0, 1.0
    for _ in range(STOP_STEPS):
        middle = (inside + beyond) / 2
        is_seen = seen_share(_on_the_way(camera, there, middle), depth) >= LEAST_SEEN
        inside, beyond = (middle, beyond) if is_seen else (inside, middle)
    return _on_the_way(camera, there, inside)


def _on_the_way(start: FreeCamera, end: FreeCamera, share: float) -> FreeCamera:
    right, down, forward = (
        a + share * (b - a) for a, b in ((start.right, end.right), (start.down, end.down), (start.forward, end.forward))
    )
    return replace(end, right=right, down=down, forward=forward)


def stepped(camera: FreeCamera, poses: Poses, steps: int) -> FreeCamera:
    """At the next pose, looking as it does; the first one after the photo's own comes first."""
    before = poses.given if camera.pose is None else camera.pose
    return FreeCamera((before + steps) % len(poses.cameras))
