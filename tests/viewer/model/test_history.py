"""Undo and redo: a drag is one edit, clicks and double clicks are what they look like, other plans keep their units."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iibr_core.beyond.optics import Optics
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.model.test_reducers import plan_of, scene_of, state_with
from viewer.model.actions import (
    Action,
    EndGesture,
    OpenPath,
    Redo,
    SceneOpened,
    SetDepthStrength,
    ShowTiltHandles,
    Undo,
)
from viewer.model.reducers.history_reducer import EDITS_KEPT
from viewer.model.reducers.root import reduce
from viewer.model.state.app_state import AppState
from viewer.model.state.motion import ReturnHome, SetLoop, Tick
from viewer.model.state.optics_actions import (
    ApplyPreset,
    FocusOn,
    MoveEye,
    ResetOptics,
    SetAperture,
    SetFocus,
    SetOptics,
)

values = st.floats(0, 3)
edits = st.one_of(
    st.builds(SetFocus, values),
    st.builds(SetAperture, values),
    st.builds(SetOptics, st.just("exposure_stops"), values),
    st.builds(lambda t, s: MoveEye(ViewOffset(t, s)), values, values),
)


def after(state: AppState, *actions: Action) -> AppState:
    for action in actions:
        state = reduce(state, action)
    return state


@given(st.lists(edits, max_size=12))
def test_undoing_everything_and_doing_it_again_comes_back_to_the_same(wanted: list[Action]) -> None:
    start = state_with(scene_of())
    state, seen = start, [start.optics]
    for edit in wanted:
        state = after(state, edit, EndGesture())
        if state.optics != seen[-1]:
            seen.append(state.optics)
    back = state
    for optics in reversed(seen[:-1]):
        back = reduce(back, Undo())
        assert back.optics == optics
    assert reduce(back, Undo()).optics == start.optics
    for optics in seen[1:]:
        back = reduce(back, Redo())
        assert back.optics == optics
    assert reduce(back, Redo()).optics == state.optics
    for optics in reversed(seen[:-1]):
        back = reduce(back, Undo())
        assert back.optics == optics, "what was done again is undone again"


def test_a_drag_is_one_edit() -> None:
    start = reduce(state_with(scene_of()), SetAperture(1))
    state = after(start, EndGesture(), *(MoveEye(ViewOffset(0, 0.1 * i)) for i in range(1, 20)), EndGesture())
    assert len(state.history.past) == 2
    assert reduce(state, Undo()).optics == start.optics


def test_two_drags_are_two_edits_and_another_kind_is_always_another() -> None:
    state = after(state_with(scene_of()), MoveEye(ViewOffset(0, 1)), EndGesture(), MoveEye(ViewOffset(0, 2)))
    assert reduce(state, Undo()).optics.eye == ViewOffset(0, 1)
    state = after(state, SetFocus(1), MoveEye(ViewOffset(0, 3)))
    assert reduce(state, Undo()).optics.eye == ViewOffset(0, 2)


def test_an_edit_after_undo_forgets_what_was_undone() -> None:
    state = after(state_with(scene_of()), SetFocus(1), Undo(), SetAperture(2))
    assert reduce(state, Redo()) == state


def test_the_history_is_bounded() -> None:
    state = state_with(scene_of())
    for i in range(EDITS_KEPT + 10):
        state = after(state, SetFocus(0.001 * i), EndGesture())
    assert len(state.history.past) == EDITS_KEPT


def test_a_double_click_takes_back_the_focus_its_first_click_set() -> None:
    start = after(state_with(scene_of()), SetFocus(1), EndGesture(), MoveEye(ViewOffset(1, 2)), EndGesture())
    click = FocusOn((0.0, 0.0), -1.0)
    clicked = after(start, click, EndGesture())
    assert clicked.optics.focus_disparity == -1
    state = after(clicked, ReturnHome(takes_back_click=True), Tick(0.0), *(Tick(0.05 * i) for i in range(1, 20)))
    assert state.optics.eye == ViewOffset(0, 0)
    assert state.optics.focus_disparity == 1
    assert not state.motion.is_running
    undone = reduce(state, Undo())
    assert undone.optics == start.optics


def test_a_double_click_on_what_is_sharp_already_keeps_an_earlier_click() -> None:
    click = FocusOn((0.0, 0.0), -1.0)
    state = after(state_with(scene_of()), click, EndGesture(), click, EndGesture(), ReturnHome(True))
    assert state.optics.focus_disparity == -1


def test_going_home_by_its_key_keeps_what_was_clicked_before() -> None:
    clicked = after(state_with(scene_of()), FocusOn((0.0, 0.0), -1.0), EndGesture())
    home = after(clicked, ReturnHome())
    assert home.optics.focus_disparity == -1
    assert after(home, Undo(), Undo()).optics.focus_disparity == 0


def test_reset_takes_all_of_the_lens_back_in_one_step() -> None:
    edits = (
        SetFocus(1.0),
        SetAperture(2.0),
        SetOptics("focus_range", 0.2),
        ShowTiltHandles(True),
        SetOptics("focus_tilt", (0.5, -0.25)),
    )
    state = after(state_with(scene_of()), *(action for edit in edits for action in (edit, EndGesture())))
    reset = after(state, ResetOptics())
    assert reset.optics == Optics()
    assert reset.tilt_handles is None
    assert after(reset, Undo()).optics == state.optics


def test_a_preset_without_tilt_has_no_handles() -> None:
    state = after(
        state_with(scene_of()), ShowTiltHandles(True), SetOptics("focus_tilt", (0.5, 0.0)), ApplyPreset("macro")
    )
    assert state.optics.focus_tilt == (0.0, 0.0)
    assert state.tilt_handles is None


def test_undo_after_a_loop_returns_to_where_it_began() -> None:
    start = reduce(state_with(scene_of()), MoveEye(ViewOffset(1, 1)))
    state = after(start, SetLoop("circle"), *(Tick(0.1 * i) for i in range(30)))
    assert state.optics.eye != start.optics.eye
    state = reduce(state, Undo())
    assert state.optics == start.optics
    assert not state.motion.is_running


def test_undoing_depth_strength_makes_the_field_anew() -> None:
    state = after(state_with(scene_of()), SetDepthStrength(2, False), SetDepthStrength(3, True), EndGesture())
    assert len(state.history.past) == 1
    undone = reduce(state, Undo())
    assert undone.depth_strength == 1
    assert undone.generation == state.generation + 1
    redone = reduce(undone, Redo())
    assert (redone.depth_strength, redone.generation) == (3, undone.generation + 1)


def test_edits_before_another_plan_are_undone_in_its_units() -> None:
    old, new = plan_of(GridShape(9, 9), scale=0.5), plan_of(GridShape(9, 9), scale=1.0)
    state = after(state_with(scene_of(plan=old)), SetFocus(1.0), EndGesture(), SetFocus(0.25), EndGesture())
    state = after(state, SetDepthStrength(2.0, True), EndGesture())
    state = reduce(state, SceneOpened(state.generation, scene_of(plan=new)))
    assert state.optics.focus_disparity == pytest.approx(0.5)
    state = reduce(state, Undo())
    state = reduce(state, SceneOpened(state.generation, scene_of(plan=old)))
    assert state.optics.focus_disparity == pytest.approx(0.25)
    assert reduce(state, Undo()).optics.focus_disparity == pytest.approx(1.0)


def test_another_file_begins_a_new_history() -> None:
    state = after(state_with(scene_of()), SetFocus(1), OpenPath(Source("b.png")))
    assert state.history.past
    state = reduce(state, SceneOpened(state.generation, scene_of(source=state.source)))
    assert state.history.past == ()
