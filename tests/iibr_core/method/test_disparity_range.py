"""The range of a map: small objects count, lone wild pixels and noise do not, in whatever units."""

import numpy as np
import pytest

from iibr_core.method.disparity_range import DisparityRange, measure_disparity_range, rounding_step
from iibr_core.method.plan import PlanOverrides, plan_for_viewing
from iibr_core.types import TOTAL_PARALLAX, GridShape
from tests.iibr_core.scenes import disparity_of, photo_of, smooth_texture

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


@pytest.mark.parametrize("noise", [0.0, 1e-4, 0.05])
@pytest.mark.parametrize("share", [0.001, 0.008, 0.3])
def test_a_bird_before_a_wall_moves_as_far_as_planned(noise, share):
    assert drawn_px(bird(noise, share)) == pytest.approx(TOTAL_PARALLAX * WIDTH, rel=1e-3)


@pytest.mark.parametrize("noise", [0.0, 1e-6, 1e-4, 1e-2])
@pytest.mark.parametrize("at", [0.0, 5.0, -300.0])
def test_a_noisy_wall_is_one_view(noise, at):
    plan = planned(wall(noise, at).astype(np.float32))
    assert plan.grid == (1, 1)
    assert plan.disparity_range_px == (0.0, 0.0)


def test_slats_are_no_noise():
    slats = np.tile(np.float32([0, 0, 0, 3, 3, 3]), (HEIGHT, WIDTH // 6))
    for values in (slats, np.ascontiguousarray(slats.T)):
        assert measure_disparity_range(values) == DisparityRange(0.0, 3.0, 0.0)


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
    """Amplified as usual, its noise would move by pixels."""
    values = wall(0.1)
    values[:, WIDTH // 2 :] += 1.0
    plan = planned(values.astype(np.float32), grid=GridShape(5, 5))
    assert 0.1 * plan.disparity_scale * 4 == pytest.approx(1.0, rel=0.05)


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (9, 1), (2, 2), (3, 3), (2, 400)])
def test_small_maps(shape):
    ramp = np.arange(shape[0] * shape[1], dtype=np.float32).reshape(shape)
    span = measure_disparity_range(ramp)
    assert ramp.min() <= span.low <= span.high <= ramp.max()
    assert span.noise >= 0
    assert measure_disparity_range(np.full(shape, 7.0, np.float32)) == DisparityRange(7.0, 7.0, 0.0)


def test_planes_have_no_noise_and_keep_their_range():
    y, x = np.mgrid[:HEIGHT, :WIDTH].astype(np.float32)
    span = measure_disparity_range(0.25 * x - 0.5 * y)
    assert span.noise == pytest.approx(0, abs=1e-5)
    assert span.range == pytest.approx(0.25 * WIDTH + 0.5 * HEIGHT, rel=0.05)


@pytest.mark.parametrize("steps", [40, 64, 255])
def test_what_a_map_is_rounded_to_is_found(steps):
    y, x = np.indices((HEIGHT, WIDTH))
    smooth = np.hypot(y - 100, x - 150) / 260
    assert rounding_step(np.round(smooth * steps).astype(np.float32) / steps) == pytest.approx(1 / steps)


@pytest.mark.parametrize("values", [wall(), bird(0.0), np.ones((1, 1), np.float32)])
def test_edges_are_no_rounding(values):
    assert rounding_step(values) == 0
