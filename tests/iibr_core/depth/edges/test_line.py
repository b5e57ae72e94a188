"""Lines through edges, on maps whose heights, slopes and ends are known."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from iibr_core.depth.edges.line import gradient, height_at


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
