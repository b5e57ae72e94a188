"""Which views a scene needs, and why."""

import numpy as np
import pytest

from iibr_core.method import memory
from iibr_core.method.memory import scene_bytes
from iibr_core.method.plan import (
    EDGE_REACH_PX,
    MAX_VIEWS_A_SIDE,
    STEP_PX,
    PlanOverrides,
    plan_for_viewing,
    plan_literal,
)
from iibr_core.types import TOTAL_PARALLAX, GridShape, InputError
from tests.iibr_core.scenes import disparity_of, square_before_wall


@pytest.mark.parametrize("scale", [1e-3, 1.0, 1e3])
def test_parallax_is_a_share_of_the_width_whatever_the_units(scale):
    photo, disparity = square_before_wall(60, 500)
    plan = plan_for_viewing(photo, disparity_of(disparity.values * scale))
    low, high = plan.disparity_range_px
    assert (high - low) * (plan.grid.columns - 1) == pytest.approx(TOTAL_PARALLAX * 500, rel=1e-3)
    assert plan.has_disocclusion


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


def test_literal_takes_disparity_as_it_is():
    photo, disparity = square_before_wall()
    plan = plan_literal(photo, disparity, GridShape(3, 3))
    assert (plan.field_disparity(disparity).values == disparity.values).all()
    assert plan.disparity_range_px == (0.0, 2.0)
    assert 0 < plan.edge_fraction < 0.5


@pytest.mark.parametrize(("step_px", "is_edge"), [(1.4, False), (1.6, True)])
def test_depth_edges_are_steps_of_one_and_a_half_pixels_in_the_outermost_view(step_px, is_edge):
    photo, disparity = square_before_wall(foreground=step_px / 2)
    assert (plan_literal(photo, disparity, GridShape(5, 3)).edge_fraction > 0) == is_edge


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("axis", [0, 1])
def test_pixels_near_a_step_up_or_down_either_way_count(axis, sign):
    photo, disparity = square_before_wall()
    values = sign * 2.0 * (np.indices(disparity.values.shape)[axis] >= 30)
    plan = plan_literal(photo, disparity_of(values), GridShape(3, 3))
    assert plan.edge_fraction == pytest.approx((2 * EDGE_REACH_PX + 1) / values.shape[axis])


def test_less_memory_gives_fewer_views(monkeypatch):
    photo, disparity = square_before_wall(300, 800)
    roomy = plan_for_viewing(photo, disparity)
    needed = scene_bytes(300 * 800, roomy.field_bytes)
    monkeypatch.setattr(memory, "free_memory_bytes", lambda: 2 * needed)
    assert plan_for_viewing(photo, disparity).grid == roomy.grid, "just enough"
    monkeypatch.setattr(memory, "free_memory_bytes", lambda: 2 * needed - 2)
    assert plan_for_viewing(photo, disparity).grid.columns < roomy.grid.columns
    monkeypatch.setattr(memory, "free_memory_bytes", lambda: 2000)
    with pytest.raises(InputError, match=r"takes \d+ MiB, half of the free memory is 1 MiB"):
        plan_for_viewing(photo, disparity)


def test_a_grid_of_no_views_is_refused_in_one_line():
    with pytest.raises(InputError, match="grid 3x0") as error:
        plan_literal(*square_before_wall(), GridShape(0, 3))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("strength", [float("nan"), float("inf")])
def test_depth_strength_must_be_finite(strength):
    with pytest.raises(InputError, match="depth strength"):
        plan_for_viewing(*square_before_wall(), PlanOverrides(depth_strength=strength))
