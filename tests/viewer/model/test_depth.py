"""Editing of depth: the map that the worker makes of the edits, its plan, and its histogram."""

from dataclasses import replace

import numpy as np
import pytest

from iibr_core.depth.choice import DepthChoice
from iibr_core.depth.editing.edits import (
    DepthEdits,
    Stroke,
)
from iibr_core.scenes.photo import apply_depth_settings, load_photo, make_plan
from iibr_core.scenes.scene import DepthSettings, Source
from iibr_core.training.degradation import blur
from iibr_core.types import GridShape
from tests.viewer.conftest import FAR, HEIGHT, NEAR, WIDTH, write_scene
from tests.viewer.model.test_opening import plan_of, scene_of, state_with
from viewer.model import lens
from viewer.model.saved_settings import settings_from_text, settings_text
from viewer.model.saving import settings_of
from viewer.ui.sections.depth_histogram import bar_heights, focus_share

GRID = GridShape(3, 3)
TONE = DepthEdits(True, 0.1, 0.9, 2.0)
STROKE = Stroke("nearer", ((0.2, 0.5), (0.8, 0.5)), 0.05, 0.5)


def test_settings_bring_the_edits_along():
    edits = replace(TONE, strokes=(STROKE, Stroke("back", ((0.1, 0.2),), 0.03, 0.1, (0.7, 0.2), tolerance=2.0)))
    state = replace(state_with(scene_of(GRID, plan=plan_of(GRID))), depth=DepthSettings(False, edits))
    state = replace(state, focused_at=(0.2, 0.1), depth_strength=1.5)
    again = settings_from_text(settings_text(settings_of(state, (96, 64))), "a.png")
    assert (again.depth_edits, again.source.depth.refine, again.view_width) == (edits, False, 60)
    assert (again.focused_at, again.depth_strength, again.size_px) == ((0.2, 0.1), 1.5, (96, 64))


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
