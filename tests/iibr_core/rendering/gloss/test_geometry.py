"""Points of a photo, in view steps."""

import numpy as np
import pytest

from iibr_core.rendering.gloss.geometry import SceneGeometry


@pytest.mark.parametrize("size", [(5, 7), (4, 6), (1, 1)])
def test_the_optical_axis_goes_through_the_middle_of_the_photo(size):
    points = SceneGeometry(90.0, -1.5).points(np.full(size, 3.0, np.float32))
    np.testing.assert_allclose(points[..., :2].mean((0, 1)), 0.0, atol=1e-6)
    np.testing.assert_allclose(points[..., 2], 90.0 / 4.5)
    np.testing.assert_allclose(np.diff(points[..., 0], axis=1), 1 / 4.5, rtol=1e-5)
    np.testing.assert_allclose(np.diff(points[..., 1], axis=0), 1 / 4.5, rtol=1e-5)
