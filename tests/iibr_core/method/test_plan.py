from dataclasses import replace

import numpy as np
import pytest

from iibr_core.method import memory
from iibr_core.method.disparity_range import DisparityRange, measure_disparity_range, rounding_step
from iibr_core.method.farthest_views import (
    LOOKUP_MARGIN_PX,
    MAX_MARGIN,
    farthest_views,
    outer_views,
    outpainting_margins,
)
from iibr_core.method.memory import scene_bytes
from iibr_core.method.plan import (
    PlanOverrides,
    plan_for_viewing,
    plan_literal,
)
from iibr_core.types import TOTAL_PARALLAX, GridShape, InputError, ViewOffset
from tests.golden_text import assert_same_text
from tests.iibr_core.scenes import disparity_of, photo_of, smooth_texture, square_before_wall

WIDE = square_before_wall(60, 1000, background=-1.0)
PLANS = {
    "planned": lambda: plan_for_viewing(*WIDE),
    "weak": lambda: plan_for_viewing(*WIDE, PlanOverrides(depth_strength=0.3)),
    "strong": lambda: plan_for_viewing(*WIDE, PlanOverrides(depth_strength=-50.0)),
    "none": lambda: plan_for_viewing(*WIDE, PlanOverrides(depth_strength=0.0)),
    "chosen": lambda: plan_for_viewing(*WIDE, PlanOverrides(GridShape(3, 8), -1.5, 2.0, "diffusion:folder")),
    "hdr with wild pixels": lambda: plan_for_viewing(replace(WIDE[0], is_hdr=True), with_wild(WIDE[1].values)),
    "flat": lambda: plan_for_viewing(WIDE[0], disparity_of(np.full((60, 1000), -3.0))),
    "literal": lambda: plan_literal(*WIDE, GridShape(4, 3)),
    "literal and wide": lambda: plan_literal(*square_before_wall(60, 80, 20.0), GridShape(2, 3), inpaint="diffusion:a"),
    "literal and still": lambda: plan_literal(*square_before_wall(60, 80, 0.2), GridShape(3, 3)),
    "literal row": lambda: plan_literal(*square_before_wall(60, 80, -2.0), GridShape(1, 7)),
}


def with_wild(values):
    wild = values.copy()
    wild[10, 3:40:4], wild[50, 77] = 1e6, -500.0
    return disparity_of(wild)


@pytest.mark.parametrize("name", PLANS)
def test_plans_and_their_words(name, regenerate_golden):
    plan = PLANS[name]()
    field = plan.field_disparity(WIDE[1])
    numbers = {
        "grid": list(plan.grid),
        "given per mille": 1000 * plan.disparity_scale,
        "zero": plan.disparity_zero,
        "range": list(plan.disparity_range_px),
        "edges": 100 * plan.edge_fraction,
        "bytes": plan.field_bytes,
        "ends": list(plan.given_range or ()),
        "field": [float(part) for part in (field.values.min(), field.values.mean(), field.values.max())],
    }
    lines = [f"{key}: {value}" for key, value in numbers.items()]
    lines += [f"holes: {plan.has_disocclusion}", *plan.reasons, *plan.notes, field.source]
    assert_same_text(lines, "core/plans", name, regenerate_golden, 1e-4, 1e-4)


def test_what_cannot_be_planned_is_refused():
    for strength in (float("nan"), float("inf"), 101.0, -101.0):
        with pytest.raises(InputError, match="depth strength"):
            plan_for_viewing(*WIDE, PlanOverrides(depth_strength=strength))
    for empty in (GridShape(0, 3), GridShape(3, 0)):
        with pytest.raises(InputError, match="give at least one view each way"):
            plan_literal(*WIDE, empty)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("axis", [0, 1])
def test_pixels_at_a_step_up_or_down_either_way_count(axis, sign):
    photo, disparity = square_before_wall()
    values = sign * 2.0 * (np.indices(disparity.values.shape)[axis] >= 30)
    plan = plan_literal(photo, disparity_of(values), GridShape(3, 3))
    assert plan.edge_fraction == pytest.approx(1 / values.shape[axis])


def test_less_memory_gives_fewer_views(monkeypatch):
    photo, disparity = square_before_wall(300, 800)
    roomy = plan_for_viewing(photo, disparity)
    assert plan_for_viewing(replace(photo, is_hdr=True), disparity).field_bytes > roomy.field_bytes
    needed = scene_bytes(300 * 800, roomy.field_bytes)
    monkeypatch.setattr(memory, "free_memory_bytes", lambda: 2 * needed)
    assert plan_for_viewing(photo, disparity).grid == roomy.grid, "just enough"
    monkeypatch.setattr(memory, "free_memory_bytes", lambda: 2 * needed - 2)
    assert plan_for_viewing(photo, disparity).grid.columns < roomy.grid.columns
    monkeypatch.setattr(memory, "free_memory_bytes", lambda: 2 * scene_bytes(300 * 800, 2 * 7 * 300 * 800))
    with pytest.raises(InputError, match="3 x 3 views of test"):
        plan_for_viewing(photo, disparity)
    monkeypatch.setattr(memory, "free_memory_bytes", lambda: 2000)
    with pytest.raises(InputError, match=r"takes \d+ MiB, half of the free memory is 1 MiB"):
        plan_for_viewing(photo, disparity)


def test_views_that_are_written_and_forgotten_need_no_memory(monkeypatch):
    photo, disparity = square_before_wall(300, 800)
    grid = GridShape(41, 41)
    monkeypatch.setattr(memory, "free_memory_bytes", lambda: 2 * scene_bytes(300 * 800, 0))
    for plan in (lambda *, keeps: plan_for_viewing(photo, disparity, PlanOverrides(grid), keeps),
                 lambda *, keeps: plan_literal(photo, disparity, grid, keeps)):  # fmt: skip
        assert plan(keeps=False).grid == grid
        with pytest.raises(InputError, match="41 x 41 views"):
            plan(keeps=True)


HEIGHT, WIDTH = 240, 320


def wall(noise=0.0, at=0.0):
    return at + noise * np.random.default_rng(0).normal(size=(HEIGHT, WIDTH)).astype(np.float32)


def bird(noise, share=0.008):
    """Return a wall with something 3 px in front of it that takes this share of the picture."""
    values = wall(noise)
    side = round((share * values.size) ** 0.5)
    values[50 : 50 + side, 200 : 200 + side] += 3.0
    return values.astype(np.float32)


def planned(values, **overrides):
    return plan_for_viewing(photo_of(smooth_texture(*values.shape)), disparity_of(values), PlanOverrides(**overrides))


def drawn_px(values, **overrides):
    """Return how far the nearest moves against the farthest from the first view to the last, as the field has it."""
    plan = planned(values, **overrides)
    field = plan.field_disparity(disparity_of(values)).values
    return float(field.max() - field.min()) * (max(plan.grid) - 1)


@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-4, 1e-2])
@pytest.mark.parametrize("at", [0.0, 5.0, -300.0])
def test_a_noisy_wall_is_one_view(noise, at):
    plan = planned(wall(noise, at).astype(np.float32))
    assert plan.grid == (1, 1)
    assert plan.disparity_range_px == (0.0, 0.0)


@pytest.mark.parametrize("wild", [1e6, -1e6, 50.0])
@pytest.mark.parametrize("count", [1, 30])
def test_lone_wild_pixels_neither_set_the_range_nor_move_beyond_it(wild, count):
    values = bird(0.01)
    expected = planned(values)
    places = np.random.default_rng(1).integers(0, values.size, count)
    values.flat[places] = wild
    assert planned(values).disparity_scale == pytest.approx(expected.disparity_scale, rel=0.02)
    assert drawn_px(values) == pytest.approx(TOTAL_PARALLAX * WIDTH, rel=1e-3)
    assert [reason for reason in planned(values).reasons if f"{len(set(places))} pixels lie far beyond" in reason]
    assert not [reason for reason in expected.reasons if "beyond" in reason]


def test_a_range_that_is_hardly_more_than_noise_moves_less():
    values = wall(0.1)
    values[:, WIDTH // 2 :] += 1.0
    plan = planned(values.astype(np.float32), grid=GridShape(5, 5))
    assert 0.1 * plan.disparity_scale * 4 == pytest.approx(1.0, rel=0.05)


def test_planes_and_slats_have_no_noise_and_keep_their_range():
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    span = measure_disparity_range(0.25 * x - 0.5 * y)
    assert span.noise == pytest.approx(0, abs=1e-5)
    assert span.range == pytest.approx(0.25 * WIDTH + 0.5 * HEIGHT, rel=0.05)
    slats = np.tile(np.float32([0, 0, 0, 3, 3, 3]), (HEIGHT, WIDTH // 6))
    for values in (slats, np.ascontiguousarray(slats.T)):
        assert measure_disparity_range(values) == DisparityRange(0.0, 3.0, 0.0)
    slats[7, 9] = np.nan
    assert measure_disparity_range(slats) == DisparityRange(0.0, 3.0, 0.0)
    for shape in ((1, 1), (1, 9), (2, 2), (2, 400)):
        assert measure_disparity_range(np.full(shape, 7.0, np.float32)) == DisparityRange(7.0, 7.0, 0.0)


@pytest.mark.parametrize("steps", [40, 64, 255])
def test_what_a_map_is_rounded_to_is_found(steps):
    y, x = np.indices((HEIGHT, WIDTH))
    smooth = np.hypot(y - 100, x - 150) / 260
    assert rounding_step(np.round(smooth * steps).astype(np.float32) / steps) == pytest.approx(1 / steps)
    for edges in (wall(), bird(0.0), np.ones((1, 1), np.float32)):
        assert rounding_step(edges) == 0


UPPER_LEFT, LOWER_RIGHT = ViewOffset(-2.0, -1.0), ViewOffset(1.0, 3.0)


def test_they_are_the_corners_around_all_viewpoints_opposite_ones_in_pairs():
    found = outer_views([ViewOffset(0.5, -1.0), UPPER_LEFT, ViewOffset(0.0, 2.0), LOWER_RIGHT])
    assert found == [(-2, -1), (1, 3), (-2, 3), (1, -1)]
    assert farthest_views(found) == 3
    assert outer_views([]) == []
    assert outer_views([ViewOffset(0.0, 2.0)]) == [(0, 2)]
    assert farthest_views([]) == farthest_views([ViewOffset(0.0, -0.5)]) == 1


@pytest.mark.parametrize("disparity", [1.5, -1.5])
def test_margins_are_what_views_see_beyond_the_frame(disparity):
    """The view at (t, s) shows at y what the photo would show at y + d t."""
    margins = outpainting_margins(np.full((80, 90), disparity, np.float32), [UPPER_LEFT, LOWER_RIGHT])
    far = {"top": 3.0, "bottom": 1.5, "left": 1.5, "right": 4.5}
    if disparity < 0:
        far = {"top": 1.5, "bottom": 3.0, "left": 4.5, "right": 1.5}
    assert margins._asdict() == {side: int(np.ceil(reach)) + LOOKUP_MARGIN_PX for side, reach in far.items()}


def test_each_side_s_own_disparity_counts_and_nothing_where_no_view_looks_out():
    disparity = np.zeros((40, 400), np.float32)
    disparity[:, -1] = 2.0
    assert outpainting_margins(disparity, [UPPER_LEFT, LOWER_RIGHT]) == (0, 0, 0, 6 + LOOKUP_MARGIN_PX)
    assert outpainting_margins(disparity, [ViewOffset(0.0, -3.0)]) == (0, 0, 0, 0)
    wide = outpainting_margins(np.full((80, 120), 50.0, np.float32), [UPPER_LEFT, LOWER_RIGHT])
    assert wide == (MAX_MARGIN * 80, MAX_MARGIN * 80, MAX_MARGIN * 120, MAX_MARGIN * 120)
    disparity = np.zeros((400, 400), np.float32)
    disparity[0, :3] = 9.0
    assert outpainting_margins(disparity, [UPPER_LEFT, LOWER_RIGHT]).top == 0, "wild pixels do not count"
