"""A gamepad: what sticks, triggers and buttons do in a moment, as a pure function."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from iibr_core.types import ViewOffset
from tests.viewer.model.test_reducers import scene_of, state_with
from viewer.app.gamepad import ACROSS_S, LONGEST_STEP_S, Gamepad, actions_from_gamepad
from viewer.model.state.app_state import AppState
from viewer.model.state.folder import StepPhoto
from viewer.model.state.motion import ReturnHome
from viewer.model.state.optics_actions import MoveEye, SetAperture, SetFocus

STATE = state_with(scene_of())
RESTING = Gamepad()


def test_a_full_stick_crosses_the_grid_in_its_time_however_often_it_is_asked() -> None:
    for seconds in (0.01, 0.05):
        (move,) = actions_from_gamepad(Gamepad(left=(1.0, 0.0)), RESTING, STATE, seconds)
        assert move == MoveEye(ViewOffset(0.0, pytest.approx(8 * seconds / ACROSS_S)))


def test_a_long_pause_is_no_long_way() -> None:
    (move,) = actions_from_gamepad(Gamepad(left=(0.0, -1.0)), RESTING, STATE, 60.0)
    assert move == MoveEye(ViewOffset(pytest.approx(-8 * LONGEST_STEP_S / ACROSS_S), 0.0))


@pytest.mark.parametrize("value", [0.0, 0.1, -0.15, math.nan, math.inf, -math.inf])
def test_what_is_near_the_middle_or_no_number_does_nothing(value: float) -> None:
    pad = Gamepad(left=(value, value), right=(value, value), opening=value)
    assert pad.is_resting
    assert actions_from_gamepad(pad, RESTING, STATE, 0.02) == []


def test_sticks_and_triggers_focus_and_open() -> None:
    near, wider = actions_from_gamepad(Gamepad(right=(0.0, -1.0), opening=1.0), RESTING, STATE, 0.02)
    assert isinstance(near, SetFocus)
    assert near.disparity > 0
    assert isinstance(wider, SetAperture)
    assert wider.diameter > 0


def test_buttons_count_once_however_long_they_are_held() -> None:
    held = Gamepad(home=True, next=True)
    assert actions_from_gamepad(held, RESTING, STATE, 0.02) == [ReturnHome(), StepPhoto(1)]
    assert actions_from_gamepad(held, held, STATE, 0.02) == []
    assert actions_from_gamepad(Gamepad(last=True), held, STATE, 0.02) == [StepPhoto(-1)]
    assert not held.is_resting


def test_an_empty_window_ignores_it() -> None:
    assert actions_from_gamepad(Gamepad(left=(1.0, 1.0), home=True), RESTING, AppState(), 0.02) == []
    assert actions_from_gamepad(replace(RESTING, home=True), RESTING, AppState(), 0.02) == []
