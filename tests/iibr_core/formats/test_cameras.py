"""Cameras of a field: where points lie, what is infinitely far, and numbers that make no cameras."""

import numpy as np
import pytest

from iibr_core.formats.cameras import MAX_DEPTH_RATIO, FieldCameras, infinity_of
from iibr_core.types import GridShape, ImageSize, ViewOffset

GRID, SIZE = GridShape(3, 3), ImageSize(64, 96)


def test_points_of_a_view_are_projected_to_where_other_views_see_them() -> None:
    """For a field whose still plane is at a finite distance, as most are."""
    cameras = FieldCameras(GRID, SIZE, 80.0, (-1.5, 2.5), -2.0)
    disparity = np.random.default_rng(0).uniform(-1.5, 2.5, SIZE).astype(np.float32)
    points = cameras.points(disparity, ViewOffset(0, 0)).astype(float)
    y, x = np.indices(SIZE)
    for offset in (ViewOffset(1, -2), ViewOffset(0.5, 3)):
        moved = points - cameras.place(offset)
        cx, cy = cameras.principal_point(offset)
        np.testing.assert_allclose(80 * moved[..., 0] / moved[..., 2] + cx - 0.5, x - disparity * offset.s, atol=1e-3)
        np.testing.assert_allclose(80 * moved[..., 1] / moved[..., 2] + cy - 0.5, y - disparity * offset.t, atol=1e-3)
    assert cameras.depth(disparity).min() >= 1
    assert cameras.depth_range == (1.0, pytest.approx(9.0))


@pytest.mark.parametrize(
    ("low", "high"), [(1.0, 5.0), (1.0, 20.0), (-3.0, 3.0), (0.001, 9.0), (2.0, 2.0), (0.0, 0.0), (-2.0, -2.0)]
)
def test_infinity_lies_beyond_all_at_a_sensible_ratio_of_depths(low: float, high: float) -> None:
    infinity = infinity_of(low, high)
    assert infinity < low
    assert (high - infinity) / (low - infinity) <= 1.00005 * MAX_DEPTH_RATIO
    assert (infinity == 0) == (low in (1.0, 2.0))


@pytest.mark.parametrize(("inverse_metres", "infinity"), [((0.5, -1.0), 2.0), ((0.0, 1.0), 0.0), ((0.5, -5.0), 0.0)])
def test_infinity_is_known_with_metres_unless_everything_would_lie_beyond(
    inverse_metres: tuple[float, float], infinity: float
) -> None:
    assert infinity_of(1.0, 9.0, inverse_metres) == infinity
