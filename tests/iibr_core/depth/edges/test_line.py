"""Lines through edges, on maps whose heights, slopes and ends are known."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from iibr_core.depth.edges.line import gradient, height_at, walk


def test_heights_are_bilinear_and_the_border_goes_on():
    values = np.random.default_rng(0).normal(0, 1, (5, 7)).astype(np.float32)
    places = np.random.default_rng(1).uniform(-2, 9, (60, 2))
    found = [height_at(values, x, y) for y, x in places]
    expected = map_coordinates(values.astype(float), places.T, order=1, mode="nearest")
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert height_at(values, 6.0, 4.0) == values[4, 6]


def test_gradients_of_planes_are_exact():
    y, x = np.mgrid[:9, :11].astype(np.float32)
    np.testing.assert_allclose(gradient(0.5 * x - 0.25 * y, 5, 4), (0.5, -0.25), atol=1e-6)
    # Rows and columns are alike.
    bumpy = np.random.default_rng(2).normal(0, 1, (9, 9)).astype(np.float32)
    assert gradient(bumpy, 3, 6) == pytest.approx(gradient(bumpy.T.copy(), 6, 3)[::-1], abs=1e-6)


def ramp(first, last, height=1.0, slant=0.0):
    """A map that rises along x between two columns, on a slanted surface."""
    x = np.arange(60, dtype=np.float32)
    return np.tile(height * np.clip((x - first) / (last - first), 0, 1) + slant * x, (9, 1)).astype(np.float32)


@pytest.mark.parametrize(("slant", "late"), [(0.0, 0), (0.005, 0), (0.03, 1)])
def test_a_walk_ends_where_the_ramp_does(slant, late):
    """On a steeper surface it takes one step more to see that it has levelled off."""
    values = ramp(20.0, 30.0, slant=slant)
    length, end, steepest, at = walk(values, 25.0, 4.0, 1.0, 0.0, 1, 20, 1.0, 9.0)
    assert (length, end) == (5.0 + late, pytest.approx(1 + (30 + late) * slant))
    assert steepest == pytest.approx(0.1 + slant, abs=1e-6)
    assert 0 < at <= 5
    down = walk(values, 25.0, 4.0, 1.0, 0.0, -1, 20, 1.0, 9.0)
    assert down[:2] == (5.0 + late, pytest.approx((20 - late) * slant))


def test_a_walk_goes_no_farther_than_told_and_ends_where_it_falls():
    steady = ramp(0.0, 59.0)
    assert walk(steady, 20.0, 4.0, 1.0, 0.0, 1, 7, 1.0, 99.0)[0] == 7
    assert walk(steady, 20.0, 4.0, 1.0, 0.0, 1, 8, 0.5, 99.0)[0] == 4
    peak = np.minimum(ramp(20.0, 30.0), ramp(40.0, 30.0))
    assert walk(peak, 26.0, 4.0, 1.0, 0.0, 1, 20, 1.0, 9.0)[:2] == (4.0, pytest.approx(1))
