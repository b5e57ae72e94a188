"""Editing of depth: verbs, undo, and the map that the worker makes of the edits."""

from dataclasses import replace

import numpy as np
import pytest

from iibr_core.beyond.optics import Optics
from iibr_core.depth.choice import DepthChoice, DepthOrigin
from iibr_core.depth.editing.edits import (
    DEPTH_TOOLS,
    GAMMA_LIMITS,
    RADIUS_LIMITS,
    DepthEdits,
    Patch,
    Stroke,
)
from iibr_core.scenes.photo import apply_depth_settings, load_photo, make_plan
from iibr_core.scenes.scene import DepthSettings, Source
from iibr_core.training.degradation import blur
from iibr_core.types import GridShape
from tests.viewer.conftest import FAR, HEIGHT, NEAR, WIDTH, reduce, write_scene
from tests.viewer.model.test_opening import plan_of, scene_of, state_with
from viewer.app.pointer import Pointer, actions_from_pointer
from viewer.model import depth, history, inspection, lens, opening, saving, selection, window
from viewer.model.action import do
from viewer.model.carried_optics import NewDepth
from viewer.model.commands import action_for_path
from viewer.model.depth import Brush, DepthSample
from viewer.model.layout import layout_of
from viewer.model.saved_settings import settings_from_text, settings_text
from viewer.model.saving import settings_of
from viewer.ui.sections.depth_histogram import bar_heights, focus_share

GRID = GridShape(3, 3)
TONE = DepthEdits(True, 0.1, 0.9, 2.0)
SAMPLE = DepthSample((0.7, 0.2), 1.5)
STROKE = Stroke("nearer", ((0.2, 0.5), (0.8, 0.5)), 0.05, 0.5)


def opened(source=None):
    """A photo with a plan, brush in hand."""
    source = source or Source("a.png")
    state = state_with(scene_of(GRID, source=source, plan=plan_of(GRID, scale=1.0)))
    return replace(state, source=source, brush=Brush(radius=0.06, is_on=True))


def test_clips_do_not_cross_and_values_are_clamped():
    state = depth.set_tone(opened(), DepthEdits(far_clip=0.3, near_clip=0.6), True)
    pushed = depth.set_tone(state, DepthEdits(far_clip=0.9, near_clip=0.6), True).depth.edits
    assert pushed.far_clip < pushed.near_clip == 0.6
    pulled = depth.set_tone(state, DepthEdits(far_clip=0.3, near_clip=0.1), True).depth.edits
    assert 0.3 == pulled.far_clip < pulled.near_clip
    wild = depth.set_tone(opened(), DepthEdits(far_clip=-3, near_clip=7, gamma=1e9), True).depth.edits
    assert (wild.far_clip, wild.near_clip, wild.gamma) == (0, 1, GAMMA_LIMITS[1])
    brush = depth.set_brush(opened(), Brush(radius=9, strength=9, tolerance=0)).brush
    assert (brush.radius, brush.strength, brush.tolerance) == (RADIUS_LIMITS[1], 1, 0.25)
    assert depth.set_tone(opened(), DepthEdits(gamma=float("nan")), True).depth.edits.gamma == GAMMA_LIMITS[0]
    assert depth.pick(opened(), DepthSample((0.5, 0.5), float("inf"))) == opened()


def test_a_stroke_keeps_points_that_lie_apart():
    state = opened()
    for place in ((0.1, 0.1), (0.101, 0.1), (0.3, 0.1)):
        state = depth.paint(state, place)
    drawn = window.end_gesture(state)
    assert drawn.depth.edits.strokes == (Stroke("nearer", ((0.1, 0.1), (0.3, 0.1)), 0.06, Brush().strength),)


@pytest.mark.parametrize("tool", DEPTH_TOOLS)
def test_level_and_bucket_give_the_picked_depth_wholly(tool):
    start = depth.set_brush(opened(), Brush(tool, strength=0.2, is_on=True))
    picked = depth.pick(start, SAMPLE)
    for state, taken_from in ((start, None), (picked, SAMPLE.place)):
        assert depth.paint(state, (0.1, 0.1)).stroke == Stroke(tool, ((0.1, 0.1),), 0.03, 1.0, taken_from)


def test_the_depth_of_a_light_field_is_left_alone():
    start = state_with(scene_of())
    assert depth.set_tone(start, TONE, True) == start
    refused = depth.set_brush(start, Brush(is_on=True))
    assert not refused.brush.is_on
    assert "cannot be edited" in refused.notices[-1].text


def test_another_photo_begins_with_its_own_depth_and_a_failed_one_gives_the_old_back():
    edited = depth.set_refine(depth.set_tone(opened(), TONE, True), False)
    source = Source("b.png", DepthChoice(refine=False))
    asked = opening.open_source(edited, source)
    assert depth.settings_for_worker(asked) == DepthSettings(False)
    assert depth.settings_for_worker(opening.report_failure(asked, asked.generation, "gone")) == edited.depth
    scene = scene_of(GRID, source=source, plan=plan_of(GRID))
    assert opening.show_scene(asked, asked.generation, scene).depth == DepthSettings(False)


def test_the_same_scene_planned_anew_keeps_its_edits_until_they_are_undone_or_reset():
    edited = window.end_gesture(depth.set_tone(opened(), TONE, True))
    again = replace(edited.scene, plan=plan_of(GRID, scale=0.5))
    state = opening.show_scene(edited, edited.generation, again)
    assert state.depth == edited.depth
    assert history.undo(state).depth == depth.reset(state).depth == DepthSettings()
    as_given = depth.set_tone(opened(Source("a.png", DepthChoice(refine=False))), TONE, True)
    assert depth.reset(as_given).depth == DepthSettings(False), "as the photo was opened"


def test_a_map_is_for_the_photo_that_is_open_and_another_photo_keeps_the_choice_of_depth():
    choice = DepthChoice("model", file="a.pfm", file_scale=2.0, model="midas", refine=False)
    source = Source("a.png", choice, grid=GRID, focus_disparity=1.0)
    kept = DepthChoice("model", model="midas", refine=False)
    photo = do(opening.open_source, replace(source, path="b.png", depth=kept, focus_disparity=None))
    given = replace(kept, start="auto", file="b.pfm", stretches=True)
    a_map = do(opening.open_source, replace(source, depth=given, focus_disparity=None))
    for kind, path, action in (("photo", "b.png", photo), ("map", "b.pfm", a_map)):
        assert action_for_path(kind, path, opened(source)) == action
        assert opening.open_paths(opened(source), [path]) == reduce(opened(source), action)


def test_the_brush_paints_on_the_surface_seen_under_it():
    state = opened()
    state = lens.move_eye(replace(state, scene=replace(state.scene, width=96, height=64)), GRID.offset(0, 2))
    layout = layout_of((1000, 800), (96, 64))
    x, y = layout.picture.x + 0.5 * layout.picture.width, layout.picture.y + 0.25 * layout.picture.height
    at = Pointer(x, y, pressed_x=x, pressed_y=y)
    pressed = replace(at, is_down=True, is_pressed=True)
    (paint,) = actions_from_pointer(pressed, layout, state, lambda x, y: 3.0)
    assert paint.verb is depth.paint
    assert paint.args[0] == pytest.approx((0.5 + 3 / 96, 0.25 - 3 / 64))
    (larger,) = actions_from_pointer(replace(at, wheel=1.0), layout, state, lambda x, y: None)
    assert reduce(state, larger).brush.radius > state.brush.radius
    drag = replace(at, is_down=True, drag_distance=50.0)
    assert actions_from_pointer(drag, layout, state, lambda x, y: 0.0) == [], "it began elsewhere"
    selecting = replace(state, brush=replace(state.brush, tool="select"))
    assert actions_from_pointer(pressed, layout, selecting, lambda x, y: 3.0) == [], "it may become a drag"
    released = replace(at, is_released=True)
    (select,) = actions_from_pointer(released, layout, selecting, lambda x, y: 3.0)
    assert (select.verb, select.args) == (selection.select, paint.args)
    (wider,) = actions_from_pointer(replace(at, wheel=1.0), layout, selecting, lambda x, y: None)
    assert reduce(selecting, wider).brush.tolerance > 1


@pytest.mark.parametrize(("given", "proposed"), [("", "_disparity.pfm"), ("a_disparity.pfm", "-edited.pfm")])
def test_a_map_is_saved_where_it_is_found_again_but_not_over_a_given_one(given, proposed):
    state = opened()
    state = replace(state, scene=replace(state.scene, depth_origin=DepthOrigin("file", given) if given else None))
    asked = saving.ask_to_save(state, "map")
    assert asked.prompt.path.endswith(proposed)


def test_settings_bring_the_edits_along():
    edits = replace(TONE, strokes=(STROKE, Stroke("back", ((0.1, 0.2),), 0.03, 0.1, (0.7, 0.2), tolerance=2.0)))
    text = settings_text(settings_of(replace(opened(), depth=DepthSettings(False, edits)), (96, 64)))
    again = settings_from_text(text, "a.png")
    assert (again.depth_edits, again.source.depth.refine, again.view_width) == (edits, False, 60)


def test_clips_keep_the_parallax_of_what_they_leave(photo_path):
    source = Source(str(photo_path), grid=GRID)
    loaded = load_photo(source)
    clipped = apply_depth_settings(loaded, DepthSettings(edits=DepthEdits(near_clip=0.5)))
    assert clipped.disparity.values.max() == pytest.approx((NEAR + FAR) / 2)
    plans = [make_plan(source, one, 1.0) for one in (loaded, clipped)]
    assert plans[1].disparity_scale == pytest.approx(plans[0].disparity_scale)


def test_refining_is_from_what_was_found_each_time(tmp_path):
    path = write_scene(tmp_path)
    soft = blur(np.load(tmp_path / "scene_disparity.npy"), 2.0)
    np.save(tmp_path / "scene_disparity.npy", soft)
    loaded = load_photo(Source(str(path), DepthChoice(refine=False)))
    full = apply_depth_settings(loaded, DepthSettings(True))
    assert not np.array_equal(full.disparity.values, soft)
    np.testing.assert_array_equal(apply_depth_settings(full, DepthSettings(False)).disparity.values, soft)


def test_a_flat_photo_can_be_painted_on(tmp_path):
    path = write_scene(tmp_path)
    np.save(tmp_path / "scene_disparity.npy", np.zeros((HEIGHT, WIDTH), np.float32))
    edits = DepthEdits(strokes=(replace(STROKE, strength=1.0, radius=0.2),))
    painted = apply_depth_settings(load_photo(Source(str(path))), DepthSettings(edits=edits))
    assert make_plan(Source(str(path)), painted, 1.0).disparity_range_px[1] > 0


def test_the_histogram_turns_with_the_map_follows_strokes_and_marks_the_focus(photo_path):
    source = Source(str(photo_path), grid=GRID)
    loaded = load_photo(source)
    heights = bar_heights(loaded.levels, False)
    assert bar_heights(loaded.levels, True) == heights[::-1]
    assert (heights[0], max(heights), heights[-1] > 0) == (1.0, 1.0, True)
    plan = make_plan(source, loaded, 1.0)
    state = state_with(scene_of(GRID, source=source, plan=plan, disparity_range_px=plan.disparity_range_px))
    near = (NEAR - plan.disparity_zero) * plan.disparity_scale
    focused = lens.set_focus(state, near)
    assert focus_share(focused, focused.scene, loaded.levels) == pytest.approx(1.0)
    pushed = Stroke("back", ((0.5, 0.5),), 0.02, 0.5)
    for is_inverted, place in ((False, 0.5), (True, 1.0)):  # 1.0: values beyond count at the ends
        edits = DepthEdits(is_inverted, strokes=(pushed,))
        counts = apply_depth_settings(loaded, DepthSettings(loaded.depth_settings.refine, edits)).levels.counts
        first = round(place * len(counts)) - 1
        assert sum(counts[max(first - 1, 0) : first + 2]) > 1000, "the square lies there now"


@pytest.mark.parametrize(
    ("focus", "focused_at", "in_focus", "expected"),
    [
        (2.0, None, None, 2.4),  # 80 % of the way from far (-2) to near (3), of -4 to 4
        (2.0, (0.5, 0.5), (2.0, -1.0), -1.0),  # the place that was clicked stays sharp
        (0.0, (0.5, 0.5), (2.0, -1.0), 0.0),  # nobody chose a focus, and the click was elsewhere
    ],
)
def test_new_depth_keeps_the_focus_where_it_was(focus, focused_at, in_focus, expected):
    optics = Optics(focus_disparity=focus, focus_range=0.5, focus_tilt=(0.5, 0.0) if focused_at is None else (0.0, 0.0))
    state = replace(opened(), optics=optics, focused_at=focused_at)
    deeper = replace(state.scene, plan=plan_of(GRID, scale=2.0), disparity_range_px=(-4.0, 4.0))
    now = opening.show_scene(state, state.generation, deeper, NewDepth(in_focus)).optics
    assert (now.focus_disparity, now.focus_range) == (pytest.approx(expected), pytest.approx(0.8))
    assert now.focus_tilt[0] == pytest.approx(1.6 * optics.focus_tilt[0])


def test_depth_that_comes_for_the_next_photo_leaves_its_focus():
    left = replace(opened(), focused_at=(0.5, 0.5), optics=Optics(focus_disparity=2.0))
    left = replace(left, models=replace(left.models, left_focus=left.optics))
    asked = opening.open_source(left, Source("b.png"))
    scene = scene_of(GRID, asked.source, plan=plan_of(GRID))
    shown = opening.show_scene(asked, asked.generation, scene)
    new_depth = NewDepth((0.0, 1.5) if shown.focused_at is not None else None)
    deep = opening.show_scene(shown, shown.generation, replace(scene, disparity_range_px=(-4.0, 4.0)), new_depth)
    assert (deep.optics.focus_disparity, deep.chosen_focus) == (0.0, None)


def test_drags_add_to_a_selection_and_erase_from_it():
    state = replace(opened(), brush=Brush("select", radius=0.06, feather=0.02, is_on=True))
    assert selection.paint(state, (0.5, 0.5), erases=True, begins=True).selection is None, "nothing to erase from"
    for place, erases, begins in (
        ((0.5, 0.5), False, True),
        ((0.6, 0.5), False, False),
        ((0.1, 0.1), True, True),
        ((0.2, 0.1), False, False),
    ):
        state = selection.paint(state, place, erases, begins)
    added, erased = Patch(((0.5, 0.5), (0.6, 0.5)), 0.06), Patch(((0.1, 0.1), (0.2, 0.1)), 0.06, erases=True)
    (stroke,) = selection.move(state, is_forward=False).depth.edits.strokes
    assert stroke == Stroke("back", (selection.NOWHERE,), 0.03, 0.1, patches=(added, erased), feather=0.02)


def test_a_selected_surface_moves_and_is_kept_sharp_and_both_are_undone():
    state = replace(selection.select(opened(), (0.25, 0.75)), brush=Brush("select", tolerance=2.0, is_on=True))
    assert selection.keep_sharp(state) == state, "its depth is not known yet"
    moved = selection.move(state, is_forward=True)
    assert moved.depth.edits.strokes == (Stroke("forward", ((0.25, 0.75),), 0.03, 0.1, tolerance=2.0),)
    assert moved.generation == state.generation + 1
    assert history.undo(moved).depth == state.depth
    sharp = selection.keep_sharp(selection.set_range(state, (1.0, 2.0)))
    assert (sharp.optics.focus_disparity, sharp.optics.focus_range) == (1.5, 0.5)
    assert sharp.focused_at == (-0.5, 0.5)
    assert history.undo(sharp).optics == state.optics, "one edit"
    assert depth.set_brush(state, replace(state.brush, tool="fill")).selection is None


def test_a_brush_that_paints_brings_the_depth_overlay_and_takes_it_away():
    start = replace(opened(), brush=Brush())
    taken = depth.set_brush(start, Brush("nearer", is_on=True))
    assert taken.inspection.overlay == "disparity"
    assert depth.set_brush(taken, replace(taken.brush, tool="select")).inspection.overlay is None
    assert depth.set_brush(taken, replace(taken.brush, is_on=False)).inspection.overlay is None
    own = depth.set_brush(inspection.set_overlay(start, "inpainted"), Brush(is_on=True))
    assert depth.set_brush(own, replace(own.brush, is_on=False)).inspection.overlay == "inpainted"
