import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.plucker import VIEW_STEP_PX, line_of, line_of_pixel
from iibr_core.types import ViewOffset

places = st.floats(-4000, 4000)
steps = st.floats(-8, 8)


@given(places, places, steps, steps)
def test_a_ray_is_the_line_through_eye_and_pixel(x, y, t, s):
    line = line_of_pixel([x], [y], ViewOffset(t, s))[0]
    direction, moment = line[:3], line[3:]
    assert np.linalg.norm(direction) == pytest.approx(1)
    assert direction @ moment == pytest.approx(0, abs=1e-6)
    for point in ([s * VIEW_STEP_PX, t * VIEW_STEP_PX, 0], [x, y, 1]):
        np.testing.assert_allclose(np.cross(point, direction), moment, atol=1e-4)


@given(places, places, st.floats(-30, 30), steps, steps)
def test_rays_of_one_point_meet(x, y, disparity, t, s):
    """The convention of types.py: a point at (x, y) in the centre view is at (x - d s, y - d t) in view (t, s)."""
    centre = line_of_pixel([x], [y], ViewOffset(0, 0))[0]
    other = line_of_pixel([x - disparity * s], [y - disparity * t], ViewOffset(t, s))[0]
    assert centre[:3] @ other[3:] + other[:3] @ centre[3:] == pytest.approx(0, abs=1e-4)


def test_a_camera_off_the_plane_sees_the_same_lines():
    """Stepping along a ray does not change the line."""
    on_plane = line_of_pixel([12.0], [-7.0], ViewOffset(1.5, -2.0))
    origin = np.array([-2.0, 1.5, 0.0]) * VIEW_STEP_PX
    stepped = line_of([origin + 0.4 * on_plane[0, :3]], on_plane[:, :3] * 3)
    assert stepped == pytest.approx(on_plane)


def test_no_direction_no_line():
    with pytest.raises(ValueError, match="no length"):
        line_of([[0, 0, 0]], [[0, 0, 0]])
