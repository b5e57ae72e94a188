import numpy as np
import pytest

from iibr_core.rendering.gloss.reflection import reflection_disparity
from tests.iibr_core.rendering.gloss.scenes import GEOMETRY, SIZE, disparity_of, plane, sphere


def test_a_sphere_reflects_what_is_far_half_its_radius_behind_its_front():
    disparity, normals, _ = sphere(centre=(0, 0, 40.0), radius=12.0)
    virtual = reflection_disparity(disparity, normals, GEOMETRY)[SIZE[0] // 2, SIZE[1] // 2]
    assert np.allclose(virtual, disparity_of(np.array(40.0 - 6.0)) * np.eye(2), atol=0.01)


def test_a_plane_reflects_what_is_far_as_far():
    disparity, normal = plane()
    virtual = reflection_disparity(disparity, np.broadcast_to(normal, (*SIZE, 3)), GEOMETRY)
    assert np.allclose(virtual[1:-1, 1:-1], GEOMETRY.infinity * np.eye(2), atol=0.05)


def test_a_hollow_that_focuses_on_the_eye_stays_finite_and_bounded():
    direction = np.stack([*np.mgrid[-1:1:60j, -1:1:80j][::-1], np.full(SIZE, 8.0)], -1).astype(np.float32)
    towards = -direction / np.linalg.norm(direction, axis=-1, keepdims=True)
    disparity = disparity_of(np.full(SIZE, 30.0))
    virtual = reflection_disparity(disparity, towards, GEOMETRY)
    assert np.isfinite(virtual).all()
    assert np.abs(virtual - disparity[..., None, None] * np.eye(2)).max() <= 3.001 * (90 / 30)


@pytest.mark.parametrize("size", [(1, 1), (1, 5), (5, 1)])
def test_a_photo_one_pixel_wide_or_high_has_no_slope_there(size):
    normals = np.broadcast_to(np.float32([0, 0, -1]), (*size, 3))
    virtual = reflection_disparity(np.full(size, 2.0, np.float32), normals, GEOMETRY)
    assert virtual.shape == (*size, 2, 2)
    assert np.isfinite(virtual).all()
