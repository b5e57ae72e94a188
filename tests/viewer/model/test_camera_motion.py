"""Motions as functions of time: where they lead, that they are smooth, and when they end."""

from __future__ import annotations

import itertools
import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iibr_core.exports.loops import LOOPS, LoopKind, point_on_loop
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.conftest import reduce
from tests.viewer.model.test_reducers import scene_of, state_with
from viewer.model import lens, viewpoint
from viewer.model.action import do
from viewer.model.state.app_state import AppState
from viewer.model.viewpoint import HOME_S, MAX_STEP_S, ease
from viewer.model.window_limits import SPEED_LIMITS

grids = st.builds(GridShape, st.integers(1, 17), st.integers(1, 17))


def ticked(state: AppState, seconds: float, start: float = 100.0, step: float = 1 / 60) -> list[AppState]:
    """The states while the clock runs."""
    states = []
    for i in range(round(seconds / step) + 1):
        state = reduce(state, do(viewpoint.tick, start + i * step))
        states.append(state)
    return states


@given(grids, st.sampled_from(LOOPS), st.floats(0, 50))
def test_loops_stay_between_the_stored_views_and_close(grid: GridShape, kind: LoopKind, turns: float) -> None:
    eye = point_on_loop(kind, turns, grid)
    for value, views in zip(eye, grid):
        assert -(views // 2) <= value <= views - 1 - views // 2
    assert point_on_loop(kind, turns + 1, grid) == pytest.approx(eye, abs=1e-9)


def test_the_shapes_of_the_loops() -> None:
    grid = GridShape(9, 9)
    quarters = [point_on_loop("circle", quarter / 4, grid) for quarter in range(4)]
    radius = math.hypot(*quarters[0])
    assert quarters[0].t < 0, "starts at the top"
    assert quarters[1].s == pytest.approx(radius), "then right: clockwise"
    assert all(math.hypot(*eye) == pytest.approx(radius) for eye in quarters)
    crossings = [point_on_loop("eight", turns, grid) for turns in (0.0, 0.5)]
    assert all(eye == pytest.approx((0, 0), abs=1e-9) for eye in crossings)
    assert all(point_on_loop("swing", turns / 10, grid).t == 0 for turns in range(10))


@pytest.mark.parametrize("kind", LOOPS)
def test_a_loop_begins_where_the_eye_is_and_goes_without_leaps(kind: LoopKind) -> None:
    start = reduce(state_with(scene_of()), do(lens.move_eye, ViewOffset(2, -3)))
    states = ticked(reduce(start, do(viewpoint.set_loop, kind)), seconds=4)
    eyes = [state.optics.eye for state in states]
    assert eyes[0] == ViewOffset(2, -3)
    steps = [math.dist(a, b) for a, b in itertools.pairwise(eyes)]
    assert max(steps) < 0.5
    assert eyes[-1] == pytest.approx(point_on_loop(kind, states[-1].motion.turns, GridShape(9, 9)))


def test_the_glide_home_is_short_monotone_and_ends_exactly_there() -> None:
    start = reduce(reduce(state_with(scene_of()), do(lens.move_eye, ViewOffset(2, -3))), do(lens.set_dolly, 1.5))
    states = ticked(reduce(start, do(viewpoint.return_home)), HOME_S + 0.1)
    distances = [math.hypot(*state.optics.eye) for state in states]
    assert distances[0] == math.hypot(2, 3)
    assert all(a >= b for a, b in itertools.pairwise(distances))
    assert (states[-1].optics.eye, states[-1].optics.dolly) == (ViewOffset(0, 0), 0.0)
    assert not states[-1].motion.is_running


def test_a_hiccup_is_no_leap() -> None:
    state = reduce(reduce(state_with(scene_of()), do(viewpoint.set_loop, "circle")), do(viewpoint.tick, 0.0))
    assert reduce(state, do(viewpoint.tick, 1000.0)).motion.turns <= MAX_STEP_S * state.motion.speed
    assert reduce(state, do(viewpoint.tick, -5.0)).motion.turns == 0, "a clock that goes back"
    assert reduce(state, do(viewpoint.tick, math.nan)) == state


def test_pause_and_speed_leave_the_eye_where_it_is() -> None:
    running = ticked(reduce(state_with(scene_of()), do(viewpoint.set_loop, "eight")), 1.0)[-1]
    paused = reduce(running, do(viewpoint.pause, True))
    assert ticked(paused, 1.0, start=500.0)[-1].optics == running.optics
    again = ticked(reduce(paused, do(viewpoint.pause, False)), 0.0, start=900.0)[-1]
    assert again.optics.eye == pytest.approx(running.optics.eye)
    faster = reduce(running, do(viewpoint.set_speed, 99.0))
    assert faster.motion.speed == SPEED_LIMITS[1]
    assert faster.motion.turns == running.motion.turns
    assert reduce(running, do(viewpoint.set_speed, math.inf)) == running


@pytest.mark.parametrize(
    "action",
    [do(lens.move_eye, ViewOffset(1, 1)), do(lens.set_dolly, 1.0), do(lens.reset), do(viewpoint.set_loop, None)],
)
def test_a_hand_on_the_viewpoint_stops_the_motion_and_keeps_its_speed(action: object) -> None:
    running = reduce(reduce(state_with(scene_of()), do(viewpoint.set_speed, 0.5)), do(viewpoint.set_loop, "circle"))
    state = reduce(running, action)  # type: ignore[arg-type]
    assert not state.motion.is_running
    assert state.motion.speed == 0.5


def test_nothing_moves_without_a_scene() -> None:
    assert reduce(AppState(), do(viewpoint.set_loop, "circle")) == AppState()
    assert reduce(replace(AppState()), do(viewpoint.tick, 1.0)) == AppState()


def test_easing_is_flat_at_both_ends_and_clamped() -> None:
    assert [ease(x) for x in (-1, 0, 0.5, 1, 2)] == [0, 0, 0.5, 1, 1]
    assert ease(0.01) < 0.001
