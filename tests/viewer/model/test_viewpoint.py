"""Verbs of the viewpoint: loops and glides as functions of time, the focus rack, the free camera, and zoom."""

import itertools
import math
from dataclasses import replace

import pytest

from iibr_core.exports.loops import LOOPS, point_on_loop
from iibr_core.scenes.scene import Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import CENTRE, GridShape, ViewOffset
from tests.viewer.model.test_opening import plan_of, scene_of, state_with
from viewer.app.keys import Keys, actions_from_keys
from viewer.model import history, lens, opening, saving, viewpoint, window
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.viewpoint import FORWARD_LIMITS, HOME_S, MAX_ASIDE, MAX_STEP_S, RACK_S, SPEED_LIMITS, FreeCamera

NINE = GridShape(9, 9)


def photo():
    return state_with(scene_of(plan=plan_of(NINE)))


def ticked(state, seconds, start=100.0, step=1 / 60):
    """Return the states while the clock runs."""
    states = []
    for i in range(round(seconds / step) + 1):
        state = viewpoint.tick(state, start + i * step)
        states.append(state)
    return states


# Loops and glides


def test_the_shapes_of_the_loops():
    quarters = [point_on_loop("circle", quarter / 4, NINE) for quarter in range(4)]
    assert quarters == [pytest.approx(eye, abs=1e-9) for eye in ((-3.2, 0), (0, 3.2), (3.2, 0), (0, -3.2))]
    assert point_on_loop("eight", 0.0, NINE) == pytest.approx((0, 0))
    assert point_on_loop("eight", 0.125, NINE) == pytest.approx((1.6, 3.2 * math.sqrt(0.5)))
    assert point_on_loop("swing", 0.25, NINE) == pytest.approx((0, 3.2))


@pytest.mark.parametrize("kind", LOOPS)
def test_a_loop_begins_where_the_eye_is_and_goes_without_leaps(kind):
    start = lens.move_eye(photo(), ViewOffset(2, -3))
    states = ticked(viewpoint.set_loop(start, kind), seconds=4)
    eyes = [state.optics.eye for state in states]
    assert eyes[0] == ViewOffset(2, -3)
    assert max(math.dist(a, b) for a, b in itertools.pairwise(eyes)) < 0.5
    assert states[-1].motion.turns == pytest.approx(4 * 0.25, abs=0.01)
    assert eyes[-1] == pytest.approx(point_on_loop(kind, states[-1].motion.turns, NINE))
    undone = history.undo(states[-1])
    assert (undone.optics, undone.motion.is_running) == (start.optics, False)


def test_the_glide_home_is_short_monotone_and_ends_exactly_there():
    start = lens.set_dolly(lens.move_eye(photo(), ViewOffset(2, -3)), 1.5)
    states = ticked(viewpoint.return_home(start), HOME_S + 0.1)
    distances = [math.hypot(*state.optics.eye) for state in states]
    assert distances[0] == math.hypot(2, 3)
    half = min(states, key=lambda state: abs(state.optics.dolly - 0.75))
    assert half.optics.dolly == pytest.approx(0.75, abs=0.2)
    assert math.hypot(*half.optics.eye) / distances[0] == pytest.approx(half.optics.dolly / 1.5), "both at once"
    assert all(a >= b for a, b in itertools.pairwise(distances))
    assert (states[-1].optics.eye, states[-1].optics.dolly) == (ViewOffset(0, 0), 0.0)
    assert not states[-1].motion.is_running


def test_a_double_click_takes_back_the_focus_of_its_first_click_and_no_earlier_one():
    start = lens.move_eye(lens.set_focus(photo(), 1.0), ViewOffset(1, 2))
    clicked = lens.focus_on(start, (0.0, 0.0), -1.0)
    home = ticked(viewpoint.return_home(clicked, takes_back_click=True), 1.0)[-1]
    assert (home.optics.eye, home.optics.focus_disparity) == (CENTRE, 1.0)
    assert history.undo(home).optics == start.optics
    twice = viewpoint.return_home(lens.focus_on(window.end_gesture(clicked), (0.0, 0.0), -1.0), True)
    assert twice.optics.focus_disparity == -1.0, "it was sharp before"
    assert viewpoint.return_home(clicked).optics.focus_disparity == -1.0, "by its key"


def test_a_delay_is_no_leap_and_a_pause_holds():
    state = viewpoint.tick(viewpoint.set_loop(photo(), "circle"), 0.0)
    assert viewpoint.tick(state, 1000.0).motion.turns == pytest.approx(MAX_STEP_S * state.motion.speed)
    assert viewpoint.tick(state, -5.0).motion.turns == 0, "a clock that goes back"
    running = ticked(viewpoint.set_loop(photo(), "eight"), 1.0)[-1]
    paused = viewpoint.pause(running, True)
    assert ticked(paused, 1.0, start=500.0)[-1].optics == running.optics
    resumed = ticked(viewpoint.pause(paused, False), 0.0, start=900.0)[-1]
    assert resumed.optics.eye == pytest.approx(running.optics.eye)
    faster = viewpoint.set_speed(running, 99.0)
    assert (faster.motion.speed, faster.motion.turns) == (SPEED_LIMITS[1], running.motion.turns)


@pytest.mark.parametrize(
    "action",
    [do(lens.move_eye, ViewOffset(1, 1)), do(lens.set_dolly, 1.0), do(lens.reset), do(viewpoint.set_loop, None)],
)
def test_a_hand_on_the_viewpoint_stops_the_motion_and_keeps_its_speed(action):
    state = action.apply(viewpoint.set_loop(viewpoint.set_speed(photo(), 0.5), "circle"))
    assert (state.motion.is_running, state.motion.speed) == (False, 0.5)


# The focus rack


def test_a_rack_glides_from_the_last_click_but_one_to_the_last_and_can_be_undone():
    state = lens.focus_on(photo(), (0.0, 0.0), 2.5)
    assert "two things" in viewpoint.rack_focus(state).notices[-1].text
    state = lens.focus_on(state, (0.5, 0.5), -1.0)
    states = ticked(viewpoint.rack_focus(state), RACK_S + 0.1)
    focuses = [state.optics.focus_disparity for state in states]
    assert (focuses[0], focuses[-1]) == (2.5, -1.0)
    assert all(a >= b for a, b in itertools.pairwise(focuses))
    assert focuses[round(RACK_S / 2 * 60)] == pytest.approx(0.75, abs=0.05)
    assert not states[-1].motion.is_running
    held = lens.focus_on(states[40], (0.0, 0.0), 1.0)
    assert (held.motion.is_running, held.optics.focus_disparity) == (False, pytest.approx(1.0)), "a click takes over"
    again = lens.focus_on(state, (0.5, 0.5), -1.0)
    assert viewpoint.clicked_rack(again) == (2.5, -1.0), "a second click on the same surface counts once"


def test_a_rack_holds_its_surfaces_in_another_plan():
    state = lens.focus_on(lens.focus_on(photo(), (0.0, 0.0), 2.0), (0.0, 0.0), -1.0)
    other = opening.show_scene(state, 1, scene_of(plan=plan_of(NINE, scale=0.5)))
    assert viewpoint.clicked_rack(other) == (1.0, -0.5)


# The free camera


@pytest.mark.parametrize(
    ("step", "end"),
    [
        ((0.0, 0.0, 0.05), FreeCamera(forward=FORWARD_LIMITS[1])),
        ((0.0, 0.0, -0.05), FreeCamera(forward=FORWARD_LIMITS[0])),
        ((-0.05, 0.0, 0.0), FreeCamera(right=-MAX_ASIDE)),
        ((0.0, 0.05, 0.0), FreeCamera(down=MAX_ASIDE)),
        ((1e300, -1e300, 1e300), FreeCamera(MAX_ASIDE, -MAX_ASIDE, FORWARD_LIMITS[1])),
    ],
)
def test_steps_of_the_camera_lead_to_its_limits_and_back(step, end):
    first = viewpoint.move_camera(photo(), 0.01, 0.02, 0.03).free_camera
    assert first == FreeCamera(0.01, 0.02, 0.03)
    assert not first.is_at_end
    state = photo()
    for _ in range(40):
        state = viewpoint.move_camera(state, *step)
    assert state.free_camera == end
    assert end.is_at_end
    assert viewpoint.move_camera(state, *(-part / 2 for part in step)).free_camera != end


def test_the_camera_needs_a_photo():
    for moved in (do(viewpoint.move_camera, 0.1), do(viewpoint.set_loop, "circle"), do(viewpoint.return_home)):
        assert moved.apply(AppState()) == AppState()
    field = viewpoint.move_camera(state_with(scene_of()), forward=0.1)
    assert field.free_camera is None
    assert "needs a photo" in field.notices[-1].text


@pytest.mark.parametrize(
    "action",
    [
        do(viewpoint.leave_camera),
        do(lens.reset),
        do(viewpoint.return_home),
        do(opening.open_source, Source("b.png")),
        *actions_from_keys(Keys(is_escape=True), viewpoint.move_camera(photo(), forward=0.1)),
    ],
)
def test_what_goes_back_to_the_views(action):
    assert action.apply(viewpoint.move_camera(photo(), forward=0.1)).free_camera is None


def test_its_picture_is_saved_at_the_size_of_the_views():
    state = photo()
    state = replace(state, scene=replace(state.scene, own_size=ScreenSize(4000, 3000)))
    stepped = lens.set_dolly(state, 1.0)
    assert saving.ask_to_save(stepped).prompt.size_px == state.scene.size
    for camera, size in ((None, ScreenSize(4000, 3000)), (FreeCamera(forward=0.1), state.scene.size)):
        prompt = saving.ask_to_save(replace(state, free_camera=camera)).prompt
        assert prompt.size_px == size
