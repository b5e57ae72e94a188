"""Verbs of the lens: clamps, presets, focus, tilt handles, gloss, and the optics of a newly planned scene."""

import math
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st

from iibr_core.beyond.optics import APERTURE_KINDS, EXPOSURE_LIMIT_STOPS, ApertureShape, Optics
from iibr_core.depth.editing.edits import DepthEdits
from iibr_core.scenes.lens_limits import (
    STEEPEST_TILT,
    aperture_limit,
    first_aperture,
    focus_limits,
    focus_span,
    is_finite,
)
from iibr_core.scenes.scene import Source
from iibr_core.types import GridShape, ViewOffset
from tests.viewer.model.test_opening import plan_of, scene_of, state_with
from viewer.model import depth, history, lens, look, opening, window
from viewer.model.action import do
from viewer.model.app_state import AppState
from viewer.model.carried_optics import carry_optics
from viewer.model.depth import Brush
from viewer.model.focal_plane import sharp_disparity
from viewer.model.lens import DEPTH_STRENGTH_LIMIT, FIRST_GLOSS, GlossBrush, TiltHandles
from viewer.model.presets import PRESETS, active_preset

floats = st.floats(allow_nan=True, allow_infinity=True)
grids = st.builds(GridShape, st.integers(1, 17), st.integers(1, 17))
shapes = st.builds(
    ApertureShape, st.sampled_from(APERTURE_KINDS), st.integers(-5, 50), floats, floats, floats, st.none()
)
NINE = GridShape(9, 9)
CLICK = do(lens.focus_on, (0.1, -0.2), 2.5)


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
    state = after(
        state_with(scene),
        do(lens.set_dolly, first),
        do(lens.set_focus, first),
        do(lens.set_focus_range, second),
        do(lens.set_focus_tilt, tilt),
        do(lens.set_aperture, second),
        do(lens.set_aperture_shape, shape),
        do(lens.set_highlights, second),
        do(lens.set_exposure, first),
        do(lens.set_depth_strength, second, is_finished=False),
    )
    optics, opening, (low, high) = state.optics, state.optics.aperture_shape, focus_limits(scene)
    assert is_finite(optics)
    assert abs(optics.dolly) <= (grid.columns - 1) / 2
    assert low <= optics.focus_disparity <= high
    assert 0 <= optics.focus_range <= focus_span(scene)
    assert max(map(abs, optics.focus_tilt)) <= STEEPEST_TILT * focus_span(scene)
    assert 0 <= optics.aperture_diameter <= aperture_limit(scene)
    assert 0 <= optics.highlight_recovery <= 1
    assert abs(optics.exposure_stops) <= EXPOSURE_LIMIT_STOPS
    assert 0 <= state.depth_strength <= DEPTH_STRENGTH_LIMIT
    assert (3 <= opening.blades <= 11, 0 <= opening.rotation_deg < 360) == (True, True)
    assert (0 <= opening.ring_inner < 1, 0 <= opening.cat_eye <= 1) == (True, True)
    assert opening.kind != "mask", "there is no mask"


# Presets


@pytest.mark.parametrize("name", PRESETS)
def test_presets_keep_viewpoint_and_light_and_are_shown_until_the_lens_changes(name):
    before = after(
        state_with(scene_of(subject_disparity_px=1.5)),
        do(lens.move_eye, ViewOffset(1, 2)),
        do(lens.set_dolly, 1.0),
        do(lens.set_exposure, 1.0),
        do(lens.set_focus_tilt, (1.0, 1.0)),
        do(lens.set_aperture, 2.0),
        do(lens.show_tilt_handles, True),
    )
    state = lens.apply_preset(before, name)
    assert active_preset(before, state.scene) is None
    assert active_preset(state, state.scene) == name
    assert active_preset(lens.set_exposure(state, 2.0), state.scene) == name
    assert active_preset(lens.set_aperture(state, 1.0), state.scene) is None
    assert (state.optics.eye, state.optics.dolly, state.optics.exposure_stops) == (ViewOffset(1, 2), 1.0, 1.0)
    assert (state.optics.focus_tilt, state.tilt_handles) == ((0, 0), None)
    assert history.undo(state).optics == before.optics


def test_a_portrait_has_a_sharp_subject_before_the_softest_background():
    state = state_with(scene_of(subject_disparity_px=1.5))
    portrait, macro, sharp = (lens.apply_preset(state, name).optics for name in PRESETS)
    assert portrait.focus_disparity == 1.5
    assert portrait.focus_range == pytest.approx(0.1 * focus_span(scene_of()))
    assert macro.focus_disparity == 3.0, "the nearest"
    assert 0 < portrait.aperture_diameter < macro.aperture_diameter < aperture_limit(scene_of())
    assert sharp.aperture_diameter == 0


def test_a_portrait_remembers_the_last_click_even_after_macro_and_another_plan():
    state = after(state_with(scene_of(plan=plan_of(NINE), subject_disparity_px=1.5)), CLICK)
    state = after(state, do(lens.apply_preset, "macro"), do(lens.apply_preset, "portrait"))
    assert state.optics.focus_disparity == 2.5
    other = opening.show_scene(state, 1, scene_of(plan=plan_of(NINE, scale=0.5), subject_disparity_px=0.75))
    portrait = after(other, do(lens.apply_preset, "macro"), do(lens.apply_preset, "portrait"))
    assert portrait.optics.focus_disparity == 1.25
    assert after(state, do(lens.reset), do(lens.apply_preset, "portrait")).optics.focus_disparity == 1.5


# Focus


@pytest.mark.parametrize("action", [do(lens.focus_on, (0.0, 0.0), 1.0), do(lens.set_focus, 1.0)])
def test_the_first_focusing_opens_the_aperture(action):
    """Through a pinhole everything is sharp: a click would seem to do nothing."""
    first = action.apply(state_with(scene_of()))
    assert first.optics.aperture_diameter == first_aperture(scene_of())
    assert history.undo(first).optics == Optics()


def test_focusing_leaves_an_aperture_alone_that_the_user_chose():
    for chosen in (do(lens.set_aperture, 0), do(lens.set_aperture, 2), do(lens.apply_preset, "everything sharp")):
        before = chosen.apply(state_with(scene_of()))
        assert lens.set_focus(before, 1.0).optics.aperture_diameter == before.optics.aperture_diameter
    assert lens.set_focus(state_with(scene_of(GridShape(1, 1))), 1.0).optics.aperture_diameter == 0


def test_reset_takes_all_of_the_lens_back_in_one_step_but_gloss():
    state = after(state_with(scene_of()), CLICK, do(lens.set_gloss, FIRST_GLOSS), do(lens.show_tilt_handles, True))
    reset = lens.reset(state)
    assert reset.optics == Optics(gloss=FIRST_GLOSS)
    assert (reset.tilt_handles, reset.focused_at) == (None, None)
    assert history.undo(reset).optics == state.optics


def test_dragging_a_handle_is_one_edit_and_lets_go_at_the_end():
    state = lens.show_tilt_handles(state_with(scene_of()), True)
    kept = TiltHandles().second
    state = lens.move_tilt_handle(state, 0, (-0.8, 0.6), 2.5)
    assert state.tilt_handles == TiltHandles((-0.8, 0.6), kept, taken=0)
    assert sharp_disparity(state.optics, (-0.8, 0.6)) == pytest.approx(2.5)
    state = lens.move_tilt_handle(state, 0, (-0.9, 5.0), None)
    assert state.tilt_handles.first == (-0.9, 1.0), "held within the picture"
    state = window.end_gesture(state)
    assert state.tilt_handles.taken is None
    assert len(state.history.past) == 1
    clicked = lens.focus_on(state, (0.9, 0.9), 0.3)
    assert sharp_disparity(clicked.optics, (0.9, 0.9)) == pytest.approx(0.3)


# Gloss


def test_a_stroke_is_one_edit_and_skips_places_that_are_close():
    brush, state = GlossBrush(radius=0.1, is_on=True), lens.set_gloss(state_with(scene_of()), FIRST_GLOSS)
    for x, begins in ((0.2, True), (0.201, False), (0.3, False)):
        state = lens.paint_gloss(state, (x, 0.5), brush, begins)
    state = window.end_gesture(state)
    assert [stroke.points for stroke in state.optics.gloss.surface.strokes] == [((0.2, 0.5), (0.3, 0.5))]
    another = window.end_gesture(lens.paint_gloss(state, (-7.0, 3.5), brush, True))
    assert another.optics.gloss.surface.strokes[1].points == ((-1.0, 2.0),), "as far beside the picture as files allow"
    assert history.undo(another).optics == state.optics
    assert history.undo(history.undo(another)).optics.gloss == FIRST_GLOSS
    assert lens.paint_gloss(state_with(scene_of()), (0.5, 0.5), brush, True).optics == Optics()
    taken = lens.take_gloss_brush(replace(state, brush=Brush(is_on=True)), brush)
    assert (taken.brush.is_on, taken.gloss_brush.is_on) == (False, True), "one brush is in hand"


# Another plan of the same scene


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (plan_of(GridShape(5, 5), 0.5, 10.0), plan_of(GridShape(9, 9), 0.25, 12.0)),
        (plan_of(GridShape(9, 9), 0.25, 12.0), plan_of(GridShape(5, 5), 0.5, 12.0)),
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


def test_depth_strength_of_zero_and_back_gives_finite_optics():
    flat, deep = plan_of(GridShape(1, 1), scale=0.0), plan_of(NINE, scale=0.5)
    state = state_with(scene_of(plan=deep))
    state = after(state, do(lens.move_eye, ViewOffset(4, 4)), do(lens.set_focus, 1), do(lens.set_aperture, 9))
    for plan in (flat, deep):
        state = opening.show_scene(state, 1, scene_of(plan.grid, plan=plan))
        assert is_finite(state.optics)
        assert 0 <= state.optics.aperture_diameter <= aperture_limit(scene_of(plan.grid, plan=plan))


def test_depth_strength_makes_the_field_again_and_ends_with_the_photo():
    state = lens.set_depth_strength(state_with(scene_of(plan=plan_of(NINE))), 2.0, is_finished=False)
    assert (state.generation, lens.requested_strength(state)) == (1, 2.0)
    state = lens.set_depth_strength(state, 2.0, is_finished=True)
    assert state.generation == 2
    other = opening.open_source(state, Source("other.png"))
    assert lens.requested_strength(other) == 1.0
    assert other.depth_strength == 2.0, "the open photo keeps it, should the other not open"
    opened = opening.show_scene(other, other.generation, scene_of(source=other.source, plan=plan_of(NINE)))
    assert opened.depth_strength == lens.requested_strength(opened) == 1.0
    first = replace(AppState(source=Source("first.png")), depth_strength=3.0)
    assert lens.requested_strength(first) == 3.0, "as the command line asks"


def test_a_look_is_given_to_another_photo_with_its_own_focus_and_strokes():
    ring = ApertureShape("ring")
    state = after(
        state_with(scene_of(plan=plan_of(NINE))),
        do(lens.set_aperture, 4.5),
        do(lens.set_focus_range, 1.2),
        do(lens.set_exposure, 1.0),
        do(lens.set_highlights, 0.5),
        do(lens.set_aperture_shape, ring),
        do(lens.move_eye, ViewOffset(1, 1)),
        do(lens.set_gloss, FIRST_GLOSS),
        do(depth.set_tone, DepthEdits(gamma=1.5), is_finished=True),
        do(depth.paint, (0.5, 0.5)),
        do(window.end_gesture),
        do(lens.set_depth_strength, 2.0, True),
        do(look.copy_look),
        do(opening.open_source, Source("b.png")),
    )
    assert state.depth.edits.strokes
    other = scene_of(GridShape(5, 5), state.source, plan=plan_of(GridShape(5, 5)), disparity_range_px=(-1.0, 1.5))
    before = after(state, do(opening.show_scene, state.generation, other), do(lens.set_focus, 1.0))
    before = after(before, do(depth.paint, (0.2, 0.2)), do(window.end_gesture))
    state = after(before, do(look.paste_look))
    wanted = replace(before.optics, aperture_diameter=3.6, focus_range=0.6, exposure_stops=1.0, highlight_recovery=0.5)
    assert state.optics == replace(wanted, aperture_shape=ring), "half open, too; the rest is its own"
    assert state.depth.edits == DepthEdits(gamma=1.5, strokes=before.depth.edits.strokes) != DepthEdits(gamma=1.5)
    assert state.depth_strength == 2.0
    assert state.generation == before.generation + 1
    assert history.undo(state).optics == before.optics
