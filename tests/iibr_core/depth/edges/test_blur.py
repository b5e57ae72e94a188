"""The blur of a map: of steps, not of slopes or of what the photo does not share."""

from __future__ import annotations

import numpy as np
import pytest

from iibr_core.depth.edges.blur import extent, measure_edge_blur
from iibr_core.training.degradation import blur
from tests.iibr_core.depth.edges.test_refine import disc_before_slope
from tests.iibr_core.scenes import smooth_texture


@pytest.mark.parametrize(
    ("sigma", "size", "measured"),
    [(1.0, 160, 1.0), (4.0, 160, 4.0), (8.0, 180, 8.0), (8.0, 140, 0), (0.0, 160, 0)],
)
def test_the_blur_of_a_map_is_measured_unless_it_is_exact_or_too_small(sigma, size, measured) -> None:
    photo, disparity, _ = disc_before_slope(size)
    soft = blur(disparity, sigma) if sigma else disparity
    np.testing.assert_allclose(measure_edge_blur(photo, soft), measured, rtol=0.15)


def parts_blurred(*sigmas: float) -> float:
    """The blur measured on a disc, three times side by side, whose map is blurred differently in each part."""
    photo, disparity, _ = disc_before_slope(160)
    maps = [blur(np.tile(disparity, (1, 3)), sigma) if sigma else np.tile(disparity, (1, 3)) for sigma in sigmas]
    disparity = np.concatenate([values[:, k * 160 : (k + 1) * 160] for k, values in enumerate(maps)], 1)
    return measure_edge_blur(np.tile(photo, (1, 3, 1)), disparity)


def test_a_map_has_the_blur_of_its_soft_edges() -> None:
    assert parts_blurred(0, 1.5, 2.0) == pytest.approx(1.75, rel=0.2)
    assert parts_blurred(2.0, 0, 2.0) == pytest.approx(2.0, rel=0.15)


def test_an_edge_that_the_photo_does_not_share_proves_nothing() -> None:
    photo, disparity, _ = disc_before_slope(160)
    soft = blur(disparity, 2.0)
    assert measure_edge_blur(photo, soft) > 0
    for other in (np.full_like(photo, 0.5), smooth_texture(160, 160)):
        assert measure_edge_blur(other, soft) == 0


def test_the_range_leaves_out_a_few_at_both_ends() -> None:
    values = np.linspace(-2, 3, 10_000, dtype=np.float32).reshape(100, 100)
    values[0, :5], values[1, :5] = 1e6, -1e6
    assert extent(values) == pytest.approx(0.96 * 5, rel=0.01)
    assert extent(np.zeros((0, 4), np.float32)) == 0
