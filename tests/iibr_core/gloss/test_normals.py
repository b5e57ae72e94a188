import numpy as np
import pytest

from iibr_core.gloss.geometry import SceneGeometry
from iibr_core.gloss.normals import fit_normals
from tests.iibr_core.gloss.scenes import GEOMETRY, SIZE, disparity_of, plane, sphere


def degrees_apart(a, b):
    return np.degrees(np.arccos(np.clip((a * b).sum(-1), -1, 1)))


def test_normals_of_a_plane_are_exact_up_to_the_border():
    disparity, normal = plane()
    assert degrees_apart(fit_normals(disparity, GEOMETRY), normal).max() < 0.2


def test_normals_of_a_sphere_come_close_and_the_wall_behind_it_stays_flat():
    disparity, normals, hit = sphere()
    apart = degrees_apart(fit_normals(disparity, GEOMETRY), normals)
    assert np.median(apart[hit]) < 1
    assert np.percentile(apart[hit], 90) < 5
    assert np.percentile(apart[~hit], 99) < 1
    step = (disparity.max() - disparity.min()) / 255
    apart = degrees_apart(fit_normals(np.round(disparity / step) * step, GEOMETRY), normals)
    assert np.median(apart[hit]) < 4, "also of a map in steps"


def test_a_depth_edge_between_two_planes_bends_neither():
    depth = np.full(SIZE, 60.0)
    depth[:, 40:] = 30.0
    facing = np.array([0, 0, -1], np.float32)
    assert degrees_apart(fit_normals(disparity_of(depth), GEOMETRY), facing).max() < 0.1


@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (5, 1), (2, 2)])
@pytest.mark.parametrize("value", [0.0, 3.0, -1.5])
def test_flat_maps_of_any_size_face_the_camera(shape, value):
    normals = fit_normals(np.full(shape, value, np.float32), GEOMETRY)
    assert np.allclose(normals, [0, 0, -1], atol=1e-3)


def test_rounding_from_pixel_to_pixel_does_not_show_in_the_normals_of_a_large_map():
    """Taps of large maps lie apart; a map that alternates must not have normals that do."""
    y, x = np.mgrid[:300, :700]
    rounded = (5 + 0.004 * x + 0.02 * ((x + y) % 2)).astype(np.float32)
    normals = fit_normals(rounded, SceneGeometry(600.0, 0.0))[40:-40, 40:-40]
    assert np.abs(np.diff(normals[..., 0], axis=1)).max() < 0.01
