"""Which views a scene needs, and why."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

from iibr_core.method import memory
from iibr_core.method.memory import scene_bytes
from iibr_core.method.plan import (
    MAX_VIEWS_A_SIDE,
    STEP_PX,
    PlanOverrides,
    plan_for_viewing,
    plan_literal,
)
from iibr_core.types import (
    TOTAL_PARALLAX,
    GridShape,
    InputError,
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
    assert huge.grid.columns == MAX_VIEWS_A_SIDE


def test_every_choice_can_be_overridden():
    photo, disparity = square_before_wall(60, 200)
    plan = plan_for_viewing(photo, disparity, PlanOverrides(GridShape(3, 7), -1.0, focus_disparity=2.0))
    assert plan.grid == (3, 7)
    assert plan.disparity_zero == 2.0
    assert plan.disparity_scale < 0
    assert plan_for_viewing(photo, disparity, PlanOverrides(depth_strength=0.0)).grid == (1, 1)


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
