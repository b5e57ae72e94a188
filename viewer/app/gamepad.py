"""A gamepad for viewpoint and focus: sticks and triggers say how fast, so time goes into what they do."""

from __future__ import annotations

import math
from dataclasses import dataclass

from iibr_core.scenes.lens_limits import aperture_limit, focus_span
from iibr_core.types import ViewOffset
from viewer.model.actions import Action
from viewer.model.state.app_state import AppState
from viewer.model.state.folder import StepPhoto
from viewer.model.state.motion import ReturnHome
from viewer.model.state.optics_actions import MoveEye, SetAperture, SetFocus

DEAD_ZONE = 0.15
"""Sticks that nobody touches do not stand quite in the middle."""
ACROSS_S, FOCUS_S, APERTURE_S = 2.0, 3.0, 3.0
"""So long a full stick takes across the grid, through the focus, and a trigger through the aperture."""
LONGEST_STEP_S = 0.1


@dataclass(frozen=True)
class Gamepad:
    """What is held now. left, right: (x, y) of the sticks, -1..1, y down; triggers: 0..1. home, last, next: buttons."""

    left: tuple[float, float] = (0.0, 0.0)
    right: tuple[float, float] = (0.0, 0.0)
    closing: float = 0.0
    opening: float = 0.0
    home: bool = False
    last: bool = False
    next: bool = False

    @property
    def is_resting(self) -> bool:
        """Whether nothing is held."""
        sticks = (*self.left, *self.right, self.closing, self.opening)
        return not any(map(_past_dead_zone, sticks)) and not (self.home or self.last or self.next)


def actions_from_gamepad(pad: Gamepad, before: Gamepad, state: AppState, seconds: float) -> list[Action]:
    """The left stick moves the viewpoint, the right one focuses nearer (up) and farther, triggers close and open the
    aperture; buttons: A back to the middle, the shoulders to the photo before and after. before: a moment ago.
    """
    scene, step = state.scene, min(max(seconds, 0.0), LONGEST_STEP_S)
    actions: list[Action] = []
    if scene is None:
        return actions
    s, t = map(_past_dead_zone, pad.left)
    if s or t:
        eye, (rows, columns) = state.optics.eye, scene.grid
        across, down = (step / ACROSS_S * max(n - 1, 1) for n in (columns, rows))
        actions.append(MoveEye(ViewOffset(eye.t + t * down, eye.s + s * across)))
    if farther := _past_dead_zone(pad.right[1]):
        actions.append(SetFocus(state.optics.focus_disparity - farther * step / FOCUS_S * focus_span(scene)))
    if wider := _past_dead_zone(pad.opening) - _past_dead_zone(pad.closing):
        widest = aperture_limit(scene.grid)
        actions.append(SetAperture(state.optics.aperture_diameter + wider * step / APERTURE_S * widest))
    if pad.home and not before.home:
        actions.append(ReturnHome())
    for steps, is_held, was_held in ((-1, pad.last, before.last), (1, pad.next, before.next)):
        actions += [StepPhoto(steps)] if is_held and not was_held else []
    return actions


def _past_dead_zone(value: float) -> float:
    """0 within the dead zone, from there on growing to 1; what is no number is 0."""
    if not math.isfinite(value) or abs(value) <= DEAD_ZONE:
        return 0.0
    return math.copysign((min(abs(value), 1.0) - DEAD_ZONE) / (1 - DEAD_ZONE), value)


class GamepadReader:
    """It sends no events: where there is one, it is asked now and then, and every frame while it is held.

    is_resting: whether it is not held; None without one.
    """

    def __init__(self) -> None:
        self._pad: Gamepad | None = None
        self._read_at = 0.0

    @property
    def is_resting(self) -> bool | None:
        """See the class."""
        return None if self._pad is None else self._pad.is_resting

    def read(self, pad: Gamepad | None, state: AppState, now_s: float) -> list[Action]:
        """What follows from how it is held now."""
        before, seconds, self._pad, self._read_at = self._pad, now_s - self._read_at, pad, now_s
        if pad is None or pad.is_resting:
            return []
        return actions_from_gamepad(pad, before or Gamepad(), state, seconds)
