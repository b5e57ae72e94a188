"""Undo and redo: a drag is one edit, clicks and double clicks are what they look like, other plans keep their units."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iibr_core.types import CENTRE, GridShape, ViewOffset
from tests.viewer.conftest import reduce
from tests.viewer.model.test_opening import plan_of, scene_of, state_with
from viewer.model import history, lens, opening, window
from viewer.model.action import do
from viewer.model.presets import active_preset

values = st.floats(0, 3)
edits = st.one_of(
    st.builds(do, st.sampled_from((lens.set_focus, lens.set_aperture, lens.set_exposure)), values),
    st.builds(lambda t, s: do(lens.move_eye, ViewOffset(t, s)), values, values),
)


def after(state, *actions):
    for action in actions:
        state = reduce(state, action)
    return state


@given(st.lists(edits, max_size=12))
def test_undoing_everything_and_doing_it_again_comes_back_to_the_same(wanted):
    start = state_with(scene_of())
    state, seen = start, [start.optics]
    for edit in wanted:
        state = after(state, edit, do(window.end_gesture))
        if state.optics != seen[-1]:
            seen.append(state.optics)
    back = state
    for optics in reversed(seen[:-1]):
        back = history.undo(back)
        assert back.optics == optics
    assert history.undo(back).optics == start.optics
    for optics in seen[1:]:
        back = history.redo(back)
        assert back.optics == optics
    assert history.redo(back).optics == state.optics


def test_a_drag_is_one_edit():
    start = lens.set_aperture(state_with(scene_of()), 1)
    state = after(
        start,
        do(window.end_gesture),
        *(do(lens.move_eye, ViewOffset(0, 0.1 * i)) for i in range(1, 20)),
        do(window.end_gesture),
    )
    assert len(state.history.past) == 2
    assert history.undo(state).optics == start.optics
    state = after(state, do(lens.set_focus, 1), do(lens.move_eye, ViewOffset(0, 3)), do(lens.move_eye, CENTRE))
    undone = history.undo(state)
    assert undone.optics.eye == pytest.approx((0, 1.9)), "another kind is another edit"
    edited = lens.set_aperture(undone, 2)
    assert history.redo(edited) == edited, "it forgets what was undone"


def test_undoing_depth_strength_makes_the_field_anew():
    state = after(
        state_with(scene_of()),
        do(lens.set_depth_strength, 2, False),
        do(lens.set_depth_strength, 3, True),
        do(window.end_gesture),
    )
    assert len(state.history.past) == 1
    undone = history.undo(state)
    assert undone.depth_strength == 1
    assert undone.generation == state.generation + 1
    redone = history.redo(undone)
    assert (redone.depth_strength, redone.generation) == (3, undone.generation + 1)


def test_edits_before_another_plan_are_undone_in_its_units():
    old, new = plan_of(GridShape(9, 9), scale=0.5), plan_of(GridShape(9, 9), scale=1.0)
    state = after(
        state_with(scene_of(plan=old)),
        do(lens.set_focus, 1.0),
        do(window.end_gesture),
        do(lens.set_focus, 0.25),
        do(window.end_gesture),
    )
    state = after(state, do(lens.set_depth_strength, 2.0, True), do(window.end_gesture))
    state = opening.show_scene(state, state.generation, scene_of(plan=new))
    assert state.optics.focus_disparity == pytest.approx(0.5)
    state = history.undo(state)
    state = opening.show_scene(state, state.generation, scene_of(plan=old))
    assert state.optics.focus_disparity == pytest.approx(0.25)
    assert history.undo(state).optics.focus_disparity == pytest.approx(1.0)


def test_undoing_depth_strength_brings_the_aperture_and_its_preset_back():
    """Discs stay as wide as they are, so the aperture follows the depth."""
    few, many = plan_of(GridShape(9, 9), scale=0.5), plan_of(GridShape(13, 13), scale=1.0)
    before = scene_of(plan=few)
    state = after(state_with(before), do(lens.apply_preset, "portrait"), do(window.end_gesture))
    wanted = state.optics.aperture_diameter
    state = after(state, do(lens.set_depth_strength, 2.0, True), do(window.end_gesture))
    wider = scene_of(GridShape(13, 13), plan=many, disparity_range_px=(-4.0, 6.0))
    state = opening.show_scene(state, state.generation, wider)
    assert state.optics.aperture_diameter == pytest.approx(wanted / 2)
    state = history.undo(state)
    state = opening.show_scene(state, state.generation, before)
    assert state.optics.aperture_diameter == pytest.approx(wanted)
    assert active_preset(state, before) == "portrait"
