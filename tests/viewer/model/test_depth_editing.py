"""What is done to the depth: actions as pure functions, what they cost, undo, and the map the worker makes of it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from iibr_core.depth.choice import DepthChoice, DepthOrigin
from iibr_core.depth.editing.edits import (
    DEPTH_TOOLS,
    GAMMA_LIMITS,
    RADIUS_LIMITS,
    UNEDITED,
    BrushTool,
    DepthEdits,
    Stroke,
)
from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.scenes.opening import results_of
from iibr_core.scenes.photo import apply_depth_settings, load_photo, make_plan
from iibr_core.scenes.scene import DepthSettings, SceneRequest, Source
from iibr_core.scenes.screen_size import ScreenSize
from iibr_core.types import GridShape, ImageSize, InputError
from tests.viewer.conftest import FAR, HEIGHT, NEAR, WIDTH, write_scene
from tests.viewer.model.test_history import after
from tests.viewer.model.test_reducers import plan_of, scene_of, state_with
from viewer.app.dropped_files import actions_from_drop
from viewer.app.headless import HeadlessViewer
from viewer.app.image_export import export_map, settings_of
from viewer.app.keys import Keys, actions_from_keys
from viewer.app.pointer import Pointer, actions_from_pointer
from viewer.model.actions import AskToSave, EndGesture, OpenFailed, OpenPath, Redo, SceneOpened, Undo
from viewer.model.commands import BY_NAME, action_for_path
from viewer.model.layout import layout_of
from viewer.model.reducers.depth_editing_reducer import (
    current_depth_settings,
    depth_settings_for_worker,
    is_depth_ahead,
)
from viewer.model.reducers.root import reduce
from viewer.model.saved_settings import settings_from_text, settings_text
from viewer.model.state.app_state import AppState
from viewer.model.state.depth_editing import (
    Brush,
    DepthSample,
    DropStroke,
    Paint,
    PickDepth,
    ResetDepth,
    SetBrush,
    SetRefine,
    SetTone,
)
from viewer.model.state.model_download import UseModel
from viewer.model.state.optics_actions import MoveEye, SetFocus
from viewer.model.state.prompts import PathPrompt, SavePrompt
from viewer.ui.sections.depth_histogram import bar_heights, focus_share

GRID = GridShape(3, 3)
TONE = DepthEdits(True, 0.1, 0.9, 2.0)
SAMPLE = DepthSample((0.7, 0.2), 1.5)
STROKE = Stroke("nearer", ((0.2, 0.5), (0.8, 0.5)), 0.05, 0.5)


def opened(source: Source | None = None) -> AppState:
    """A photo with a plan, brush in hand."""
    source = source or Source("a.png")
    state = state_with(scene_of(GRID, source=source, plan=plan_of(GRID, scale=1.0)))
    return replace(state, source=source, brush=Brush(radius=0.06, is_on=True))


def test_tone_costs_views_only_once_the_edit_is_finished() -> None:
    start = opened()
    held = reduce(start, SetTone(TONE, is_finished=False))
    assert held.depth.edits == TONE
    assert held.generation == start.generation
    assert is_depth_ahead(held, depth_settings_for_worker(start))
    assert reduce(held, SetTone(TONE, is_finished=True)).generation == start.generation + 1


def test_one_drag_of_a_slider_is_one_edit() -> None:
    start = opened()
    state = after(start, *(SetTone(DepthEdits(gamma=1 + i / 10), i == 9) for i in range(10)), EndGesture())
    assert len(state.history.past) == 1
    undone = reduce(state, Undo())
    assert undone.depth == start.depth
    assert undone.generation == state.generation + 1
    assert reduce(undone, Redo()).depth == state.depth


def test_clips_do_not_cross_and_values_are_clamped() -> None:
    state = reduce(opened(), SetTone(DepthEdits(far_clip=0.3, near_clip=0.6), True))
    pushed = reduce(state, SetTone(DepthEdits(far_clip=0.9, near_clip=0.6), True)).depth.edits
    assert pushed.far_clip < pushed.near_clip == 0.6
    pulled = reduce(state, SetTone(DepthEdits(far_clip=0.3, near_clip=0.1), True)).depth.edits
    assert 0.3 == pulled.far_clip < pulled.near_clip
    wild = reduce(opened(), SetTone(DepthEdits(far_clip=-3, near_clip=7, gamma=1e9), True)).depth.edits
    assert (wild.far_clip, wild.near_clip, wild.gamma) == (0, 1, GAMMA_LIMITS[1])
    brush = reduce(opened(), SetBrush(Brush(radius=9, strength=9))).brush
    assert (brush.radius, brush.strength) == (RADIUS_LIMITS[1], 1)


@pytest.mark.parametrize(
    "action",
    [
        SetTone(DepthEdits(gamma=float("nan")), True),
        SetBrush(Brush(radius=float("nan"))),
        Paint((float("nan"), 0.0)),
        PickDepth(DepthSample((0.5, 0.5), float("inf"))),
    ],
    ids=lambda action: type(action).__name__,
)
def test_values_that_are_not_finite_change_nothing(action: SetTone) -> None:
    assert reduce(opened(), action) == opened()


def test_a_stroke_becomes_an_edit_when_the_pointer_goes_up() -> None:
    start = opened()
    drawn = after(start, Paint((0.1, 0.1)), Paint((0.101, 0.1)), Paint((0.3, 0.1)))
    assert drawn.stroke == Stroke("nearer", ((0.1, 0.1), (0.3, 0.1)), 0.06, start.brush.strength)
    assert drawn.depth == start.depth
    assert current_depth_settings(drawn).edits.strokes == (drawn.stroke,)
    assert drawn.generation == start.generation
    ended = reduce(drawn, EndGesture())
    assert ended.depth.edits.strokes == (drawn.stroke,)
    assert ended.stroke is None
    assert ended.generation == start.generation + 1
    twice = after(ended, Paint((0.5, 0.5)), EndGesture())
    assert len(twice.depth.edits.strokes) == 2
    assert reduce(twice, Undo()).depth == ended.depth
    assert after(twice, Undo(), Undo()).depth == start.depth
    assert after(twice, Undo(), Undo(), Redo(), Redo()).depth == twice.depth


@pytest.mark.parametrize("tool", DEPTH_TOOLS)
def test_level_and_bucket_give_the_picked_depth_wholly_until_another_photo_opens(tool: BrushTool) -> None:
    start = reduce(opened(), SetBrush(Brush(tool, strength=0.2, is_on=True)))
    stroke = reduce(start, Paint((0.1, 0.1))).stroke
    assert stroke is not None
    assert (stroke.strength, stroke.taken_from) == (1.0, None)
    picked = reduce(start, PickDepth(SAMPLE))
    stroke = reduce(picked, Paint((0.1, 0.1))).stroke
    assert stroke is not None
    assert (stroke.tool, stroke.taken_from) == (tool, SAMPLE.place)
    settings = replace(UNEDITED, strokes=(stroke,))
    saved = settings_of(replace(picked, depth=DepthSettings(edits=settings)), ScreenSize(10, 10))
    assert settings_from_text(settings_text(saved), "a").depth_edits == settings
    elsewhere = reduce(picked, SceneOpened(picked.generation, scene_of(GRID, source=Source("b.png"))))
    assert elsewhere.brush.sample is None


def test_picking_a_depth_takes_the_tool_in_hand_that_gives_it() -> None:
    picked = reduce(opened(), PickDepth(SAMPLE))
    assert picked.brush.tool == "level"
    moved = after(picked, SetBrush(replace(picked.brush, tool="smooth")), Paint((0.1, 0.1))).stroke
    assert moved is not None
    assert moved.taken_from is None
    pointer, layout = pointer_at(0.5, 0.25, is_down=True, is_pressed=True, holds_ctrl=True)
    (action,) = actions_from_pointer(pointer, layout, opened(), lambda x, y: 3.0)  # type: ignore[arg-type]
    assert isinstance(action, PickDepth)
    assert action.sample == DepthSample(pytest.approx((0.5, 0.25)), 3.0)  # type: ignore[arg-type]


def test_escape_takes_a_stroke_back_then_puts_the_brush_away() -> None:
    drawn = reduce(opened(), Paint((0.5, 0.5)))
    (drop,) = actions_from_keys(Keys(is_escape=True), drawn)
    assert drop == DropStroke()
    dropped = reduce(drawn, drop)
    assert dropped.stroke is None
    assert dropped.depth == drawn.depth
    assert dropped.generation == drawn.generation + 1, "the worker was stopped when the stroke began"
    (away,) = actions_from_keys(Keys(is_escape=True), dropped)
    assert not reduce(dropped, away).brush.is_on


def test_the_depth_of_a_light_field_is_left_alone() -> None:
    start = state_with(scene_of())
    assert reduce(start, SetTone(TONE, True)) == start
    told = reduce(start, SetBrush(Brush(is_on=True)))
    assert not told.brush.is_on
    assert "cannot be edited" in told.notices[-1].text


def test_another_photo_begins_with_its_own_depth_and_a_failed_one_gives_the_old_back() -> None:
    edited = after(opened(), SetTone(TONE, True), SetRefine(False))
    source = Source("b.png", DepthChoice(refine=False))
    asked = reduce(edited, OpenPath(source))
    assert depth_settings_for_worker(asked) == DepthSettings(False)
    failed = reduce(asked, OpenFailed(asked.generation, "gone"))
    assert depth_settings_for_worker(failed) == edited.depth
    scene = scene_of(GRID, source=source, plan=plan_of(GRID))
    assert reduce(asked, SceneOpened(asked.generation, scene)).depth == DepthSettings(False)


def test_the_same_scene_planned_anew_keeps_its_edits_and_its_history() -> None:
    edited = after(opened(), SetTone(TONE, True), EndGesture())
    assert edited.scene is not None
    state = reduce(edited, SceneOpened(edited.generation, replace(edited.scene, plan=plan_of(GRID, scale=0.5))))
    assert state.depth == edited.depth
    assert reduce(state, Undo()).depth == DepthSettings()


def test_reset_takes_everything_back_at_once() -> None:
    state = after(
        opened(Source("a.png", DepthChoice(refine=False))), SetTone(TONE, True), SetRefine(True), ResetDepth()
    )
    assert state.depth == DepthSettings(False)


DECIDED = Source(
    "a.png",
    DepthChoice("model", file="a.pfm", file_scale=2.0, model="midas", refine=False),
    grid=GRID,
    focus_disparity=1.0,
)


@pytest.mark.parametrize("way", ["dialog", "drop"])
def test_another_file_keeps_what_was_decided_about_depth(way: str) -> None:
    state = opened(DECIDED)
    action = action_for_path("photo", "b.png", state) if way == "dialog" else actions_from_drop(["b.png"], state)[0]
    depth = DepthChoice("model", model="midas", refine=False)
    wanted = replace(DECIDED, path="b.png", depth=depth, focus_disparity=None)
    assert action == OpenPath(wanted)


def test_a_map_is_for_the_photo_that_is_open() -> None:
    depth = DepthChoice("auto", file="b.pfm", model="midas", refine=False, stretches=True)
    wanted = replace(DECIDED, depth=depth, focus_disparity=None)
    assert action_for_path("map", "b.pfm", opened(DECIDED)) == OpenPath(wanted)
    assert actions_from_drop(["b.pfm"], opened(DECIDED)) == [OpenPath(wanted)]
    assert action_for_path("model", "/m", opened(DECIDED)) == UseModel("/m")


def pointer_at(share_x: float, share_y: float, **more: object) -> tuple[Pointer, object]:
    layout = layout_of((1000, 800), (96, 64))
    assert layout.picture is not None
    x, y = layout.picture.x + share_x * layout.picture.width, layout.picture.y + share_y * layout.picture.height
    return Pointer(x, y, pressed_x=x, pressed_y=y, **more), layout  # type: ignore[arg-type]


def test_the_brush_paints_on_the_surface_seen_under_it() -> None:
    state = opened()
    assert state.scene is not None
    scene = replace(state.scene, width=96, height=64)
    state = reduce(replace(state, scene=scene), MoveEye(GRID.offset(0, 2)))
    pointer, layout = pointer_at(0.5, 0.25, is_down=True, is_pressed=True)
    (paint,) = actions_from_pointer(pointer, layout, state, lambda x, y: 3.0)  # type: ignore[arg-type]
    assert isinstance(paint, Paint)
    assert paint.place == pytest.approx((0.5 + 3 / 96, 0.25 - 3 / 64))
    wheel, layout = pointer_at(0.5, 0.5, wheel=1.0)
    (larger,) = actions_from_pointer(wheel, layout, state, lambda x, y: None)  # type: ignore[arg-type]
    assert isinstance(larger, SetBrush)
    assert larger.brush.radius > state.brush.radius


def test_a_drag_that_began_elsewhere_does_not_paint() -> None:
    pointer, layout = pointer_at(0.5, 0.5, is_down=True, drag_distance=50.0)
    assert actions_from_pointer(pointer, layout, opened(), lambda x, y: 0.0) == []  # type: ignore[arg-type]


def test_commands_of_depth() -> None:
    state = opened()
    off = reduce(state, BY_NAME["Depth brush"].action(state))
    assert not off.brush.is_on
    smooth = reduce(off, BY_NAME["Depth brush: smooth"].action(off))
    assert (smooth.brush.tool, smooth.brush.is_on) == ("smooth", True)
    assert reduce(off, BY_NAME["Invert depth"].action(off)).depth.edits == DepthEdits(is_inverted=True)
    asked = reduce(off, AskToSave("map"))
    assert isinstance(asked.prompt, SavePrompt)
    assert asked.prompt.what == "map"
    assert asked.prompt.path.endswith("_disparity.pfm"), "where it is found the next time"


def test_a_given_map_is_not_proposed_to_be_overwritten() -> None:
    state = opened()
    assert state.scene is not None
    state = replace(state, scene=replace(state.scene, depth_origin=DepthOrigin("file", "a_disparity.pfm")))
    asked = reduce(state, AskToSave("map"))
    assert isinstance(asked.prompt, SavePrompt)
    assert asked.prompt.path.endswith("-edited.pfm")
    assert reduce(state, BY_NAME["Open a depth map…"].action(state)).tasks
    assert PathPrompt("map").what == "map"


def test_settings_bring_the_edits_along() -> None:
    state = replace(opened(), depth=DepthSettings(False, replace(TONE, strokes=(STROKE,))))
    settings = settings_of(state, (96, 64))
    again = settings_from_text(settings_text(settings), "a.png")
    assert again.depth_edits == state.depth.edits
    assert not again.source.depth.refine
    plain = settings_of(replace(state, depth=DepthSettings()), (96, 64))
    assert "depth_edits" not in settings_text(plain)
    assert settings_from_text(settings_text(plain), "a.png").depth_edits == UNEDITED


@pytest.mark.parametrize("damage", ['"gamma":0', '"gamma":null', '"strokes":[{}]', '"strokes":7'])
def test_damaged_edits_in_settings_are_told(damage: str) -> None:
    state = replace(opened(), depth=DepthSettings(edits=TONE))
    name = damage.partition(":")[0]
    text = settings_text(settings_of(state, (96, 64)))
    whole = text.replace(f"{name}:2.0", damage).replace(f"{name}:[]", damage)
    assert whole != text
    with pytest.raises(InputError, match=rf"a\.png: .*{name.strip(chr(34))}"):
        settings_from_text(whole, "a.png")


def test_the_worker_edits_what_it_read_once(photo_path: Path) -> None:
    source = Source(str(photo_path), grid=GRID)
    first = next(results_of(SceneRequest(1, source), lambda: GRID.offset(1, 1)))
    photo_path.unlink()
    depth_settings = DepthSettings(edits=DepthEdits(strokes=(Stroke("nearer", ((0.5, 0.5),), 0.1, 0.5),)))
    second = next(results_of(SceneRequest(2, source, 1.0, first.loaded, depth_settings), lambda: GRID.offset(1, 1)))
    assert second.loaded.disparity.values.max() == pytest.approx(NEAR + 0.5 * (NEAR - FAR), abs=0.03)
    assert second.scene.plan.disparity_scale == pytest.approx(first.scene.plan.disparity_scale, rel=1e-3)
    assert second.scene.plan.disparity_zero == first.scene.plan.disparity_zero
    back = next(results_of(SceneRequest(3, source, 1.0, second.loaded), lambda: GRID.offset(1, 1)))
    np.testing.assert_array_equal(back.centre.disparity, first.centre.disparity)


def test_clips_keep_the_parallax_of_what_they_leave(photo_path: Path) -> None:
    source = Source(str(photo_path), grid=GRID)
    loaded = load_photo(source)
    clipped = apply_depth_settings(loaded, DepthSettings(edits=DepthEdits(near_clip=0.5)))
    assert clipped.disparity.values.max() == pytest.approx((NEAR + FAR) / 2)
    plans = [make_plan(source, one, 1.0) for one in (loaded, clipped)]
    assert plans[1].disparity_scale == pytest.approx(plans[0].disparity_scale)


def test_refining_is_from_what_was_found_each_time(tmp_path: Path) -> None:
    path = write_scene(tmp_path)
    soft = np.load(tmp_path / "scene_disparity.npy")
    for _ in range(6):
        soft[:, 1:-1] = (soft[:, :-2] + soft[:, 1:-1] + soft[:, 2:]) / 3
        soft[1:-1] = (soft[:-2] + soft[1:-1] + soft[2:]) / 3
    np.save(tmp_path / "scene_disparity.npy", soft)
    loaded = load_photo(Source(str(path), DepthChoice(refine=False)))
    np.testing.assert_array_equal(loaded.disparity.values, soft)
    full = apply_depth_settings(loaded, DepthSettings(True))
    assert not np.array_equal(full.disparity.values, soft)
    np.testing.assert_array_equal(
        full.disparity.values, load_photo(Source(str(path), DepthChoice(refine=True))).disparity.values
    )
    np.testing.assert_array_equal(apply_depth_settings(full, DepthSettings(False)).disparity.values, soft)


def test_a_flat_photo_can_be_painted_on(tmp_path: Path) -> None:
    path = write_scene(tmp_path)
    np.save(tmp_path / "scene_disparity.npy", np.zeros((HEIGHT, WIDTH), np.float32))
    source = Source(str(path))
    edits = DepthEdits(strokes=(replace(STROKE, strength=1.0, radius=0.2),))
    painted = apply_depth_settings(load_photo(source), DepthSettings(edits=edits))
    assert make_plan(source, painted, 1.0).disparity_range_px[1] > 0


def test_a_saved_map_is_the_same_scene_when_it_is_opened_again(photo_path: Path, tmp_path: Path) -> None:
    source = Source(str(photo_path), grid=GRID)
    edits = DepthEdits(gamma=0.5, strokes=(replace(STROKE, tool="farther"),))
    out = tmp_path / "edited.pfm"
    with HeadlessViewer("egl") as viewer:
        viewer.open_scene(source, 1.0, edits)
        viewer.make_views()
        loaded = viewer._scene_view.loaded
        assert loaded is not None
        wanted = loaded.disparity.values
        assert export_map(out, wanted) == f"Saved {out}."
    np.testing.assert_array_equal(read_disparity(out, ImageSize(HEIGHT, WIDTH)).values, wanted)
    again = load_photo(replace(source, depth=DepthChoice(file=str(out), refine=False)))
    np.testing.assert_array_equal(again.disparity.values, wanted)


def test_the_histogram_turns_with_the_map_and_the_focus_stays_on_its_surface(photo_path: Path) -> None:
    source = Source(str(photo_path), grid=GRID)
    ready = next(results_of(SceneRequest(1, source), lambda: GRID.offset(1, 1)))
    levels, scene = ready.scene.levels, ready.scene
    heights = bar_heights(levels, False)
    assert bar_heights(levels, True) == heights[::-1]
    assert (heights[0], max(heights), heights[-1] > 0) == (1.0, 1.0, True)
    state = replace(AppState(source=source), scene=scene)
    near = (NEAR - scene.plan.disparity_zero) * scene.plan.disparity_scale
    assert focus_share(reduce(state, SetFocus(near)), scene, levels) == pytest.approx(1.0)
