"""Laws for any numbers: clamps, undo and redo, loops, the tilted plane, and optics carried to another plan."""

import itertools
import math

import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from iibr_core.beyond.optics import APERTURE_KINDS, EXPOSURE_LIMIT_STOPS, ApertureShape, Optics
from iibr_core.exports.loops import LOOPS, point_on_loop
from iibr_core.scenes.lens_limits import STEEPEST_TILT, aperture_limit, focus_limits, focus_span, is_finite
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.model.test_opening import grids, plan_of, scene_of, state_with
from viewer.model import history, lens, opening, viewpoint, window
from viewer.model.action import do
from viewer.model.carried_optics import carry_optics
from viewer.model.focal_plane import MIN_HANDLE_DISTANCE, sharp_disparity, tilt_through
from viewer.model.lens import DEPTH_STRENGTH_LIMIT
from viewer.model.presets import active_preset

floats = st.floats(allow_nan=True, allow_infinity=True)
shapes = st.builds(
    ApertureShape, st.sampled_from(APERTURE_KINDS), st.integers(-5, 50), floats, floats, floats, st.none()
)
shares, disparities, values = st.floats(-1, 1), st.floats(-5, 5), st.floats(0, 3)
places = st.tuples(shares, shares)
edits = st.one_of(
    st.builds(do, st.sampled_from((lens.set_focus, lens.set_aperture, lens.set_exposure)), values),
    st.builds(lambda t, s: do(lens.move_eye, ViewOffset(t, s)), values, values),
)
NINE = GridShape(9, 9)


def after(state, *actions):
    for action in actions:
        state = action.apply(state)
    return state


@given(grids, floats, floats)
def test_the_eye_stays_within_the_grid_and_beside_a_single_row(grid, t, s):
    before = state_with(scene_of(grid))
    eye = lens.move_eye(before, ViewOffset(t, s)).optics.eye
    if not (math.isfinite(t) and math.isfinite(s)):
        assert eye == before.optics.eye
        return
    for value, wanted, views in zip(eye, (t, s), grid):
        margin = 0.5 if views == 1 else 0.0
        assert value == min(max(wanted, -(views // 2) - margin), views - 1 - views // 2 + margin)


@given(grids, floats, floats, st.tuples(floats, floats), shapes)
def test_every_number_stays_finite_and_within_its_limits(grid, first, second, tilt, shape):
    scene = scene_of(grid)
    wild = (
        *(do(verb, first) for verb in (lens.set_dolly, lens.set_focus, lens.set_exposure)),
        *(do(verb, second) for verb in (lens.set_focus_range, lens.set_aperture, lens.set_highlights)),
        do(lens.set_focus_tilt, tilt), do(lens.set_aperture_shape, shape),
        do(lens.set_depth_strength, second, is_finished=False),
    )  # fmt: skip
    state = after(state_with(scene), *wild)
    optics, hole, (low, high) = state.optics, state.optics.aperture_shape, focus_limits(scene)
    assert is_finite(optics)
    assert abs(optics.dolly) <= (grid.columns - 1) / 2
    assert low <= optics.focus_disparity <= high
    assert 0 <= optics.focus_range <= focus_span(scene)
    assert max(map(abs, optics.focus_tilt)) <= STEEPEST_TILT * focus_span(scene)
    assert 0 <= optics.aperture_diameter <= aperture_limit(scene)
    assert 0 <= optics.highlight_recovery <= 1
    assert abs(optics.exposure_stops) <= EXPOSURE_LIMIT_STOPS
    assert 0 <= state.depth_strength <= DEPTH_STRENGTH_LIMIT
    assert (3 <= hole.blades <= 11, 0 <= hole.rotation_deg < 360) == (True, True)
    assert (0 <= hole.ring_inner < 1, 0 <= hole.cat_eye <= 1, hole.kind != "mask") == (True, True, True)


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


def test_undoing_depth_strength_brings_the_aperture_and_its_preset_back():
    """Discs stay as wide as they are, so the aperture follows the depth."""
    few, many = plan_of(NINE, scale=0.5), plan_of(GridShape(13, 13), scale=1.0)
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


@pytest.mark.parametrize("kind", LOOPS)
def test_a_loop_begins_where_the_eye_is_and_goes_without_leaps(kind):
    start = lens.move_eye(state_with(scene_of(plan=plan_of(NINE))), ViewOffset(2, -3))
    states = [viewpoint.set_loop(start, kind)]
    for i in range(241):
        states.append(viewpoint.tick(states[-1], 100 + i / 60))
    eyes = [state.optics.eye for state in states]
    assert eyes[0] == ViewOffset(2, -3)
    assert max(math.dist(a, b) for a, b in itertools.pairwise(eyes)) < 0.5
    assert states[-1].motion.turns == pytest.approx(4 * 0.25, abs=0.01)
    assert eyes[-1] == pytest.approx(point_on_loop(kind, states[-1].motion.turns, NINE))
    undone = history.undo(states[-1])
    assert (undone.optics, undone.motion.is_running) == (start.optics, False)


@given(places, places, disparities, disparities, st.tuples(disparities, disparities), st.floats(0.1, 3))
def test_the_plane_runs_through_both_handles_and_is_level_across_them(moved, kept, there, focus, tilt, aspect):
    line = moved[0] - kept[0], (moved[1] - kept[1]) * aspect
    assume(math.hypot(*line) >= MIN_HANDLE_DISTANCE)
    before = Optics(focus_disparity=focus, focus_tilt=tilt)
    after = tilt_through(before, moved, there, kept, aspect)
    assert sharp_disparity(after, moved) == pytest.approx(there, abs=1e-6)
    assert sharp_disparity(after, kept) == pytest.approx(sharp_disparity(before, kept), abs=1e-6)
    across = kept[0] - line[1], kept[1] + line[0] / aspect  # a right angle to the line, as the eye sees it
    assert sharp_disparity(after, across) == pytest.approx(sharp_disparity(after, kept), abs=1e-6)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (plan_of(GridShape(5, 5), 0.5, 10.0), plan_of(NINE, 0.25, 12.0)),
        (plan_of(NINE, 0.25, 12.0), plan_of(GridShape(5, 5), 0.5, 12.0)),
        (plan_of(GridShape(3, 7), -0.5, 1.0), plan_of(GridShape(5, 13), -0.25, 1.0)),
    ],
)
def test_another_grid_with_the_same_parallax_shows_the_same(old, new):
    """More views stand closer together: where rays run, and which given disparity is sharp, stays."""
    before = Optics(ViewOffset(0.5, -1.5), dolly=1.0, focus_disparity=0.4, focus_tilt=(0.1, 0.0), aperture_diameter=1.5)
    carried = carry_optics(before, scene_of(old.grid, plan=old), scene_of(new.grid, plan=new))

    def seen(optics, plan):
        steps = plan.grid.columns - 1
        sharp = optics.focus_disparity / plan.disparity_scale + plan.disparity_zero
        tilt = optics.focus_tilt[0] / plan.disparity_scale
        return optics.dolly / steps, optics.eye.s / steps, optics.aperture_diameter / steps, sharp, tilt

    assert seen(carried, new) == pytest.approx(seen(before, old))
    single, five = (scene_of(GridShape(1, n), plan=plan_of(GridShape(1, n), scale=0.5)) for n in (1, 5))
    assert carry_optics(Optics(eye=ViewOffset(0.0, -0.5)), single, five).eye.s == -2.0, "one view counts as one step"
