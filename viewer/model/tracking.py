"""A window that follows the head: packets of a tracker, a filter against noise, and verbs that move the viewpoint.

Packets are those of opentrack's output "UDP over network": six little-endian doubles, x, y, z in cm, then yaw, pitch
and roll in degrees (`enum Axis` of its `api/plugin-api.hpp`). The signs, on which its `tracker-tobii/`,
`tracker-neuralnet/` and `proto-flightgear/` agree, are for a person who faces the screen: x grows to the left, y up, z
away from the screen; yaw grows as the head turns right, pitch as it looks up. In this program a place of the head is a
complex number in cm, right + 1j * down, as s and t of a viewpoint.
"""

from __future__ import annotations

import math
import re
import struct
from dataclasses import dataclass, replace

from iibr_core.scenes.lens_limits import clamp, clamp_eye, eye_limits
from iibr_core.scenes.scene import Scene
from iibr_core.types import CENTRE, InputError, ViewOffset
from viewer.model.action import Setter, setter
from viewer.model.app_state import AppState
from viewer.model.messages import Notice, notify


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


POSE = struct.Struct("<6d")
MAX_NUMBER = 1000.0
"""Largest number of a pose, in cm or degrees; packets with others are dropped."""
CM_PER_DEGREE = 0.5
"""Movement that a turn of the head stands for, from trackers that send no place."""
MIN_CUTOFF_HZ, CUTOFF_PER_SPEED, SPEED_CUTOFF_HZ = 1.0, 0.5, 1.0
"""Cutoff of the filter at rest, its growth in Hz per cm/s, and the cutoff for the speed itself."""
GAP_S = 0.5
"""Pause between two packets after which the filter starts again, in seconds."""
HEAD_RANGE_LIMITS = 3.0, 60.0
"""Shortest and longest movement of the head from the middle to the outermost views, in cm."""
EDITS_BY_HAND = "move_eye", "return_home", "reset", "set_loop"
"""Kinds of edits after which the head's present place belongs to the viewpoint that they led to."""


def address_of(text: str) -> tuple[str, int]:
    """Return host and port of a tracker: udp, udp:PORT or udp:HOST:PORT. Raises InputError."""
    match = re.fullmatch(r"udp(?::([\w.-]*[A-Za-z_.-][\w.-]*))?(?::(\d{1,5}))?", text.strip(), re.ASCII)
    port = int(match[2] or 4242) if match else 0
    if match is None or not 0 < port < 65536:
        raise InputError(f"{text!r} is no tracker: give udp:PORT or udp:HOST:PORT, such as udp:4242")
    return match[1] or "127.0.0.1", port


def head_in(packet: bytes) -> complex | None:
    """Return the head's place in cm, right + 1j * down; None if the packet is no pose.

    Trackers that know only how the head turns send exactly 0 for x and y: yaw and pitch move the viewpoint then.
    """
    if len(packet) != POSE.size:
        return None
    numbers = POSE.unpack(packet)
    if not all(abs(number) <= MAX_NUMBER for number in numbers):  # not so for NaN
        return None
    left, up, _, yaw, pitch, _ = numbers
    return complex(-left, -up) if left or up else CM_PER_DEGREE * complex(yaw, -pitch)


@dataclass(frozen=True)
class Smoothed:
    """A place after the filter, the same before it, its speed per second, and the time of its packet in seconds."""

    place: complex
    raw: complex
    speed: complex
    time_s: float


def smooth(before: Smoothed | None, place: complex, time_s: float) -> Smoothed:
    """Return the next place after a One Euro filter: a low pass whose cutoff grows with the speed.

    Casiez, Roussel, Vogel: 1 € filter: a simple speed-based low-pass filter for noisy input in interactive systems,
    CHI 2012. A place that moves fast lags by at most 1 / (2 pi CUTOFF_PER_SPEED) = 0.32 cm.
    """
    step_s = GAP_S if before is None else time_s - before.time_s
    if before is None or step_s >= GAP_S:
        return Smoothed(place, place, 0j, time_s)
    if step_s <= 0:
        return before
    speed = before.speed + _weight(SPEED_CUTOFF_HZ, step_s) * ((place - before.raw) / step_s - before.speed)
    weight = _weight(MIN_CUTOFF_HZ + CUTOFF_PER_SPEED * abs(speed), step_s)
    return Smoothed(before.place + weight * (place - before.place), place, speed, time_s)


def _weight(cutoff_hz: float, step_s: float) -> float:
    """Return the weight of the newest value in a low pass of first order."""
    turned = 2 * math.pi * cutoff_hz * step_s
    return turned / (1 + turned)


def eye_of(offset: complex, range_cm: float, scene: Scene) -> ViewOffset:
    """Return the viewpoint for a head this far from its centre: it slows down towards the outermost views.

    A centimetre is as many distances between columns to the right as down; at range_cm the grid's longer side ends.
    """
    ways = zip((offset.imag, offset.real), _ends(range_cm, scene))
    t, s = (far * math.sin(math.pi / 2 * clamp(cm / end_cm, -1, 1)) for cm, (far, end_cm) in ways)
    return clamp_eye(ViewOffset(t, s), scene.grid)


def offset_of(eye: ViewOffset, range_cm: float, scene: Scene) -> complex:
    """Return how far from its centre the head is at a viewpoint; the inverse of `eye_of`."""
    t, s = (end_cm * math.asin(step / far) * 2 / math.pi for step, (far, end_cm) in zip(eye, _ends(range_cm, scene)))
    return complex(s, t)


def _ends(range_cm: float, scene: Scene) -> list[tuple[float, float]]:
    """Return the farthest steps down and right, each with the movement of the head to there in cm."""
    steps = [max(map(abs, eye_limits(views))) for views in scene.grid]
    columns = steps[0] * scene.row_step, steps[1]
    return [(far, range_cm * wide / max(columns)) for far, wide in zip(steps, columns)]


def switch(state: AppState, address: str | None) -> AppState:
    """Follow the head by the tracker at an address (see `address_of`) and remember that; None stops."""
    if address is None:
        return replace(state, tracking=None)
    return replace(state, tracking=Tracking(address), preferences=replace(state.preferences, tracker=address))


set_head_range: Setter[float] = setter("preferences.head_range_cm", HEAD_RANGE_LIMITS)
"""Set the movement of the head from the middle to the outermost views, in cm."""


def set_receiving(state: AppState, is_receiving: bool) -> AppState:
    """Show whether poses arrive, with a notice if none ever came."""
    before = state.tracking
    if before is None:
        return state
    state = replace(state, tracking=replace(before, is_receiving=is_receiving))
    if is_receiving or before.head is not None:
        return state
    place = "{}:{}".format(*address_of(before.address))
    return notify(state, Notice(f'No poses at {place}: let opentrack send there, by its output "UDP over network".'))


def follow(state: AppState, head: complex, latency_ms: float) -> AppState:
    """Move the viewpoint to a place of the head, unless it moves by itself or a stroke is being painted.

    The first place is the centre. Where the viewpoint was moved by hand, the centre moves with it.
    """
    before, scene, eye = state.tracking, state.scene, state.optics.eye
    if before is None:
        return state
    is_moving = state.motion.is_running and state.motion.kind != "rack"
    tracking = replace(before, head=head, latency_ms=latency_ms)
    if scene is None or is_moving or state.stroke is not None or state.free_camera is not None:
        return replace(state, tracking=tracking)
    range_cm, centre = state.preferences.head_range_cm, before.centre
    if centre is None or (eye != before.eye and state.history.last in EDITS_BY_HAND):
        centre = (head if before.head is None else before.head) - offset_of(eye, range_cm, scene)
    eye = eye_of(head - centre, range_cm, scene)
    return replace(state, tracking=replace(tracking, centre=centre, eye=eye), optics=replace(state.optics, eye=eye))
