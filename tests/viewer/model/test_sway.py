"""The demo sways until the first touch, well within its views, and what is kept knows nothing of it."""

from __future__ import annotations

from dataclasses import replace

import pytest

from iibr_core.beyond.optics import CENTRE, Optics
from iibr_core.scenes.lens_limits import FIRST_APERTURE
from iibr_core.scenes.scene import Progress, Source
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.model.test_reducers import SOURCE, scene_of
from viewer.model.actions import Action, OpenPath, ProgressMade, RestoreSession, SceneOpened
from viewer.model.reducers.camera_motion import SWAY_TURN_S, SWAY_TURNS
from viewer.model.reducers.root import reduce
from viewer.model.state.app_state import AppState
from viewer.model.state.motion import PauseMotion, SetLoop, Sway, Tick, Touch
from viewer.model.state.optics_actions import MoveEye, SetFocus
from viewer.model.state.saving import SavedSettings
from viewer.model.state.tasks import MaySwayTask

GRID = GridShape(9, 9)
STEP_S = 0.05


def opened(*, is_demo: bool = True) -> AppState:
    state = reduce(AppState(), OpenPath(SOURCE, is_demo))
    return reduce(state, SceneOpened(state.generation, scene_of(GRID, SOURCE)))


def swaying() -> AppState:
    state = reduce(opened(), Sway())
    for step in range(60):
        state = reduce(state, Tick(step * STEP_S))
    assert state.optics.eye != CENTRE
    return state


def test_the_demo_opens_with_the_aperture_a_little_open_and_other_photos_do_not() -> None:
    assert opened().optics.aperture_diameter == pytest.approx(FIRST_APERTURE * 9)
    assert opened(is_demo=False).optics == Optics()


def test_it_waits_until_every_view_is_there_and_is_asked_for_once() -> None:
    state = opened()
    for progress, asks in ((Progress(80, 81), 0), (Progress(81, 81), 1)):
        state = reduce(state, ProgressMade(state.generation, progress))
        assert state.tasks.count(MaySwayTask()) == asks
    again = reduce(state, ProgressMade(state.generation, Progress(81, 81)))
    assert again.tasks.count(MaySwayTask()) == 1
    still = opened(is_demo=False)
    still = reduce(still, ProgressMade(still.generation, Progress(81, 81)))
    assert MaySwayTask() not in still.tasks


def test_it_stays_well_within_the_views_and_ends_by_itself_where_it_began() -> None:
    state, farthest, clock_s = reduce(opened(), Sway()), 0.0, 0.0
    while state.motion.is_running:
        before, clock_s = state.optics.eye, clock_s + STEP_S
        state = reduce(state, Tick(clock_s))
        farthest = max(farthest, *map(abs, state.optics.eye))
        assert max(abs(a - b) for a, b in zip(state.optics.eye, before)) < 0.1, "it is slow"
    assert 0.8 < farthest < 2, "of 4 views to each side"
    assert state.optics.eye == pytest.approx(CENTRE, abs=1e-9)
    assert clock_s == pytest.approx(SWAY_TURNS * SWAY_TURN_S, abs=3 * STEP_S)


@pytest.mark.parametrize(
    "action",
    [Touch(), MoveEye(ViewOffset(1, 1)), SetFocus(1.0), SetLoop("circle")],
    ids=lambda action: type(action).__name__,
)
def test_the_first_touch_stops_it_where_it_is(action: Action) -> None:
    state = swaying()
    touched = reduce(state, action)
    assert touched.motion.kind != "sway"
    assert touched.optics.eye == (action.eye if isinstance(action, MoveEye) else state.optics.eye)
    assert touched.optics.aperture_diameter == state.optics.aperture_diameter
    assert touched.motion.speed == state.motion.speed


@pytest.mark.parametrize("action", [Touch(), SetFocus(1.0)], ids=lambda action: type(action).__name__)
def test_a_touch_before_it_begins_forbids_it(action: Action) -> None:
    touched = reduce(opened(), action)
    done = reduce(touched, ProgressMade(touched.generation, Progress(81, 81)))
    assert MaySwayTask() not in done.tasks
    assert not reduce(done, Sway()).motion.is_running


def test_a_touch_leaves_a_loop_of_the_users_alone() -> None:
    looping = reduce(opened(), SetLoop("circle"))
    assert reduce(looping, Touch()).motion.kind == "circle"


def test_another_photo_and_what_was_left_of_this_one_stand_still() -> None:
    state = swaying()
    other = reduce(state, OpenPath(Source("other.png")))
    other = reduce(other, SceneOpened(other.generation, scene_of(GRID, Source("other.png"))))
    assert (other.motion.is_running, other.optics.aperture_diameter) == (False, 0)
    left = SavedSettings(Optics(eye=ViewOffset(1, 0)), 1.0, Source(""), (60, 40))
    restored = reduce(opened(), RestoreSession(left))
    assert restored.optics.eye == ViewOffset(1, 0)
    assert not reduce(restored, Sway()).motion.is_running


def test_what_is_kept_has_the_viewpoint_that_the_user_left() -> None:
    state = swaying()
    assert state.at_rest.optics == opened().optics
    moved = reduce(reduce(opened(), MoveEye(ViewOffset(1, 2))), SetLoop("circle"))
    for step in range(40):
        moved = reduce(moved, Tick(step * STEP_S))
    assert moved.optics.eye != ViewOffset(1, 2)
    assert moved.at_rest.optics.eye == ViewOffset(1, 2)
    paused = reduce(moved, PauseMotion(True))
    assert paused.at_rest == paused, "there it was held"
    still = replace(opened(), awaits_touch=False)
    assert still.at_rest == still
