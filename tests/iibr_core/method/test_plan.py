import re
import subprocess
import sys
from dataclasses import replace
from itertools import product

import numpy as np
import pytest
from iibr_core.generation.cost_model import estimate_workload, largest_offset, measure_parallax

from iibr_core.method import memory
from iibr_core.method.light_field import generate, rays_of_grid
from iibr_core.method.memory import scene_bytes
from iibr_core.method.plan import (
    MOST_VIEWS_A_SIDE,
    STEP_PX,
    PlanOverrides,
    plan_for_viewing,
    plan_literal,
)
from iibr_core.method.rays import CELL_PX
from iibr_core.training.batches import ambiguous_rays_of_view
from iibr_core.training.degradation import blur
from iibr_core.training.scenes.random_scene import random_scene, render
from iibr_core.types import (
    TOTAL_PARALLAX,
    GridShape,
    ImageSize,
    InputError,
    ViewOffset,
)
from tests.iibr_core.scenes import disparity_of, photo_of, smooth_texture, square_before_wall


def test_constant_disparity_needs_one_view():
    photo = photo_of(smooth_texture(40, 60))
    plan = plan_for_viewing(photo, disparity_of(np.full((40, 60), 7.0)))
    assert plan.grid == (1, 1)
    assert not plan.has_disocclusion
    assert plan.edge_fraction == 0
    assert np.abs(plan.field_disparity(disparity_of(np.full((40, 60), 7.0))).values).max() == 0


def test_parallax_is_a_share_of_the_width_whatever_the_units():
    photo, disparity = square_before_wall(60, 500)
    for scale in (1e-3, 1.0, 1e3):
        plan = plan_for_viewing(photo, disparity_of(disparity.values * scale))
        low, high = plan.disparity_range_px
        assert (high - low) * (plan.grid.columns - 1) == pytest.approx(TOTAL_PARALLAX * 500, rel=1e-3)
    assert plan.has_disocclusion


def test_depth_of_less_trust_moves_less():
    photo, disparity = square_before_wall(60, 500)
    plan = plan_for_viewing(photo, replace(disparity, viewing_share=0.5))
    low, high = plan.disparity_range_px
    assert (high - low) * (plan.grid.columns - 1) == pytest.approx(0.5 * TOTAL_PARALLAX * 500, rel=1e-3)


def test_grid_follows_the_parallax():
    photo, disparity = square_before_wall(60, 1000)
    small = plan_for_viewing(photo, disparity, PlanOverrides(depth_strength=0.3))
    assert small.grid.columns < plan_for_viewing(photo, disparity).grid.columns
    assert 0.3 * TOTAL_PARALLAX * 1000 / (small.grid.columns - 1) <= STEP_PX
    huge = plan_for_viewing(photo, disparity, PlanOverrides(depth_strength=50))
    assert huge.grid.columns == MOST_VIEWS_A_SIDE


def test_every_choice_can_be_overridden():
    photo, disparity = square_before_wall(60, 200)
    plan = plan_for_viewing(photo, disparity, PlanOverrides(GridShape(3, 7), -1.0, focus_disparity=2.0))
    assert plan.grid == (3, 7)
    assert plan.disparity_zero == 2.0
    assert plan.disparity_scale < 0
    assert plan_for_viewing(photo, disparity, PlanOverrides(depth_strength=0.0)).grid == (1, 1)


def test_a_flat_scene_needs_next_to_nothing():
    photo, disparity = square_before_wall(300, 400)
    flat = plan_for_viewing(photo, disparity_of(np.zeros((300, 400))))
    deep = plan_for_viewing(photo, disparity)
    for quality in ("fast", "balanced"):
        assert flat.costs.of(quality).seconds == 0
    assert deep.costs.fast.seconds < deep.costs.balanced.seconds


def test_needs_follow_views_pixels_and_depth_edges():
    def seconds(size, side, foreground=2.0):
        photo, disparity = square_before_wall(*size, foreground=foreground)
        return plan_literal(photo, disparity, GridShape(side, side)).costs

    small, wider = seconds((120, 160), 5), seconds((240, 320), 5)
    assert 3 < wider.fast.seconds / small.fast.seconds < 4.2
    assert seconds((120, 160), 9).fast.seconds / small.fast.seconds == pytest.approx(80 / 24, rel=0.2)
    even = seconds((120, 160), 5, foreground=0.0)
    assert even.balanced.seconds == pytest.approx(even.fast.seconds)
    assert small.balanced.seconds > 1.2 * small.fast.seconds


@pytest.mark.parametrize("blur_px", [0.0, 2.0])
def test_the_rays_foretold_are_those_really_ambiguous(blur_px):
    size, grid = (120, 160), GridShape(9, 9)
    predicted, found = [], []
    for seed in range(4):
        scene = random_scene(np.random.default_rng(seed), ImageSize(*size), 2.0)
        colors, values = render(scene, ImageSize(*size), ViewOffset(0.0, 0.0))
        photo, disparity = photo_of(colors), disparity_of(blur(values, blur_px))
        rays, completing = rays_of_grid(photo, disparity, plan_literal(photo, disparity, grid))
        assert len(list(completing)) == 4
        statistics = measure_parallax(disparity.values, largest_offset(grid))
        for reach in (1.0, 2.0, 4.0):
            predicted.append(statistics.ambiguous_share(reach / 4) * disparity.values.size)
            found.append(len(ambiguous_rays_of_view(rays, ViewOffset(reach, -reach), (0, size[0]), False).pixel))
    assert sum(predicted) == pytest.approx(sum(found), rel=0.3), (predicted, found)


@pytest.mark.parametrize("grid", [GridShape(1, 7), GridShape(2, 9), GridShape(2, 2), GridShape(5, 5)], ids=str)
def test_as_many_views_are_counted_again_as_complete_the_ray_set(grid):
    photo, disparity = square_before_wall(60, 80, 3.0)
    again = len(list(rays_of_grid(photo, disparity, plan_literal(photo, disparity, grid))[1]))
    statistics = measure_parallax(disparity.values, largest_offset(grid))
    fast, balanced = (estimate_workload(statistics, grid, quality) for quality in ("fast", "balanced"))
    assert balanced.pixels - fast.pixels == again * disparity.values.size


def test_plans_load_no_kernels_until_one_is_made():
    code = "import sys, iibr_core.method.plan; print('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"


def test_one_wild_value_does_not_set_the_baseline():
    photo, disparity = square_before_wall(60, 200)
    reference = plan_for_viewing(photo, disparity).disparity_scale
    values = disparity.values.copy()
    values[0, 0] = 1e6
    assert plan_for_viewing(photo, disparity_of(values)).disparity_scale == pytest.approx(reference)


def test_literal_takes_disparity_as_it_is():
    photo, disparity = square_before_wall()
    plan = plan_literal(photo, disparity, GridShape(3, 3))
    assert (plan.field_disparity(disparity).values == disparity.values).all()
    assert plan.disparity_range_px == (0.0, 2.0)
    assert 0 < plan.edge_fraction < 0.5


@pytest.mark.parametrize(
    ("inpaint", "words", "paints"),
    [
        ("background", "inpainted by background: nearest to true views, though smooth.", False),
        ("diffusion:folder", "inpainted by diffusion: as asked.", True),
    ],
)
def test_the_plan_names_what_fills_the_holes(inpaint, words, paints):
    photo, disparity = square_before_wall(60, 200)
    for plan in (
        plan_for_viewing(photo, disparity, PlanOverrides(inpaint=inpaint)),
        plan_literal(photo, disparity, GridShape(3, 3), inpaint=inpaint),
    ):
        assert any(reason.endswith(words) for reason in plan.reasons)
        assert any("The model paints up to 4 views" in reason for reason in plan.reasons) == paints


def test_nothing_fills_holes_where_there_are_none():
    photo, disparity = square_before_wall()
    flat = plan_literal(photo, disparity_of(np.zeros_like(disparity.values)), GridShape(3, 3), inpaint="diffusion:f")
    assert not any("diffusion" in reason or "paints" in reason for reason in flat.reasons)


def test_less_memory_gives_fewer_views(monkeypatch):
    photo, disparity = square_before_wall(300, 800)
    roomy = plan_for_viewing(photo, disparity)
    needed = scene_bytes(300 * 800, roomy.field_bytes)
    monkeypatch.setattr(memory, "free_memory_bytes", lambda: 2 * needed)
    assert plan_for_viewing(photo, disparity).grid == roomy.grid, "just enough"
    monkeypatch.setattr(memory, "free_memory_bytes", lambda: 2 * needed - 2)
    assert plan_for_viewing(photo, disparity).grid.columns < roomy.grid.columns
    monkeypatch.setattr(memory, "free_memory_bytes", lambda: 2000)
    with pytest.raises(InputError, match=r"takes \d+ MiB, half of the free memory is 1 MiB: lower --grid or --max-pix"):
        plan_for_viewing(photo, disparity)


def test_a_grid_of_no_views_is_refused_in_one_line():
    with pytest.raises(InputError, match="--grid 3x0") as error:
        plan_literal(*square_before_wall(), GridShape(0, 3))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("strength", [float("nan"), float("inf")])
def test_depth_strength_must_be_finite(strength):
    with pytest.raises(InputError, match="depth-strength"):
        plan_for_viewing(*square_before_wall(), PlanOverrides(depth_strength=strength))


def quality_planned(parallax_px, wanted=None):
    """Of a wall with many small squares before it that move so far to either side."""
    random = np.random.default_rng(0)
    values = np.zeros((300, 400), np.float32)
    for y, x in random.integers(0, 290, (200, 2)):
        values[y : y + 9, x : x + 9] = parallax_px / 4
    photo = photo_of(random.random((300, 400, 3)))
    return plan_literal(photo, disparity_of(values), GridShape(9, 9), quality=wanted)


def test_the_transformer_is_asked_where_there_is_something_to_decide():
    asked, small = quality_planned(8.0), quality_planned(1.0)
    assert asked.quality == "balanced"
    assert small.quality == "fast"
    assert any("no ray is ambiguous" in reason for reason in small.reasons)


@pytest.mark.parametrize("wanted", ["fast", "balanced"])
def test_the_quality_asked_for_wins(wanted):
    plan = quality_planned(150.0, wanted)
    assert plan.quality == wanted
    assert any("as asked" in reason for reason in plan.reasons)


def test_generation_follows_the_plan():
    """Where the plan says fast, no weights are read: views are those of the closed form."""
    photo, disparity = square_before_wall(60, 80, foreground=3.0)
    disparity = disparity_of(np.mean([np.roll(disparity.values, k, axis=1) for k in range(-2, 3)], axis=0))
    plan = plan_literal(photo, disparity, GridShape(1, 3))
    made = {
        q: [view.colors for view in generate(photo, disparity, replace(plan, quality=q))] for q in ("fast", "balanced")
    }
    asked = [view.colors for view in generate(photo, disparity, plan, quality="fast")]
    assert all((one == other).all() for one, other in zip(made["fast"], asked))
    assert any((one != other).any() for one, other in zip(made["balanced"], asked))


def test_no_time_is_told_before_anything_was_measured():
    photo, disparity = square_before_wall()
    plan = plan_literal(photo, disparity, GridShape(9, 9))
    assert not re.search(r"\d (s|min)\b", " ".join(plan.reasons))


@pytest.mark.parametrize(("step_px", "meets"), [(1.4, False), (1.6, True)])
def test_surfaces_meet_from_a_step_of_one_and_a_half_pixels_on(step_px, meets):
    _, disparity = square_before_wall(foreground=step_px, background=0.0)
    statistics = measure_parallax(disparity.values, 1.0)
    assert (statistics.edge_share > 0) == meets
    assert (statistics.ambiguous_share(1.0) > 0) == meets
    assert statistics.ambiguous_share(0.5) == 0


@pytest.mark.parametrize("size", [(1, 1), (3, 9), (8, 12), (11, 6)])
def test_steps_and_spread_of_cells_against_a_slow_twin(size):
    values = np.random.default_rng(3).normal(0, 2, size).astype(np.float32)
    found = measure_parallax(values, 1.0)
    assert found.step.shape == found.spread.shape == (-(-size[0] // CELL_PX), -(-size[1] // CELL_PX))
    for row, column in np.ndindex(found.step.shape):
        y, x = CELL_PX * row, CELL_PX * column
        around = values[y : y + 2 * CELL_PX, x : x + 2 * CELL_PX]
        assert found.spread[row, column] == around.max() - around.min()
        steps = [0.0]
        for v, u in product(range(y, min(y + CELL_PX, size[0])), range(x, min(x + CELL_PX, size[1]))):
            beside = [(v - 1, u), (v + 1, u), (v, u - 1), (v, u + 1)]
            steps += [abs(values[v, u] - values[b]) for b in beside if 0 <= b[0] < size[0] and 0 <= b[1] < size[1]]
        assert found.step[row, column] == max(steps)
    assert found.pixels == size[0] * size[1]
