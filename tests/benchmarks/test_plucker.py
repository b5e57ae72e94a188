import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.plucker import (
    VIEW_STEP_PX,
    depth_of,
    distance_between,
    line_of,
    line_of_pixel,
    offset_of_line,
    pixel_of_line,
)
from iibr_core.types import ViewOffset

places = st.floats(-4000, 4000)
steps = st.floats(-8, 8)


@given(places, places, steps, steps)
def test_a_ray_and_its_line_are_the_same(x, y, t, s):
    lines = line_of_pixel([x], [y], ViewOffset(t, s))
    assert np.linalg.norm(lines[0, :3]) == pytest.approx(1)
    assert lines[0, :3] @ lines[0, 3:] == pytest.approx(0, abs=1e-6)
    assert np.ravel(pixel_of_line(lines)) == pytest.approx([x, y], abs=1e-5)
    assert np.ravel(offset_of_line(lines)) == pytest.approx([t, s], abs=1e-5)


@given(places, places, st.floats(-30, 30), steps, steps)
def test_rays_of_one_point_meet_at_its_depth(x, y, disparity, t, s):
    """The convention of types.py: a point at (x, y) in the centre view is at (x - d s, y - d t) in view (t, s)."""
    centre = line_of_pixel([x], [y], ViewOffset(0, 0))
    other = line_of_pixel([x - disparity * s], [y - disparity * t], ViewOffset(t, s))
    assert distance_between(centre, other)[0] == pytest.approx(0, abs=1e-4)
    z = depth_of(disparity)
    eye = np.array([s, t, 0]) * VIEW_STEP_PX
    point = np.array([x * z, y * z, z])
    seen_along = line_of([eye], [point - eye])
    assert np.ravel(pixel_of_line(seen_along)) == pytest.approx([x - disparity * s, y - disparity * t], abs=1e-4)


def test_a_camera_off_the_plane_sees_the_same_lines():
    """Stepping along a ray changes neither the line nor what the slab says of it."""
    on_plane = line_of_pixel([12.0], [-7.0], ViewOffset(1.5, -2.0))
    origin = np.array([-2.0, 1.5, 0.0]) * VIEW_STEP_PX
    stepped = line_of([origin + 0.4 * on_plane[0, :3]], on_plane[:, :3] * 3)
    assert stepped == pytest.approx(on_plane)


def test_distances_of_skew_and_parallel_lines():
    along_x = line_of([[0, 0, 0]], [[1, 0, 0]])
    assert distance_between(along_x, line_of([[5, 0, 3]], [[0, 1, 0]]))[0] == pytest.approx(3)
    assert distance_between(along_x, line_of([[5, 4, 3]], [[2, 0, 0]]))[0] == pytest.approx(5)
    assert distance_between(along_x, line_of([[5, 4, 3]], [[-2, 0, 0]]))[0] == pytest.approx(5)


def test_no_direction_no_line_and_no_crossing_no_pixel():
    with pytest.raises(ValueError, match="no length"):
        line_of([[0, 0, 0]], [[0, 0, 0]])
    x, y = pixel_of_line(line_of([[0, 0, 5]], [[1, 0, 0]]))
    assert not np.isfinite([x, y]).all()
    assert depth_of(-VIEW_STEP_PX) == np.inf
