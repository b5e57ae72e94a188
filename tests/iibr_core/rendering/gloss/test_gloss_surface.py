import numpy as np
import pytest

from iibr_core.rendering.gloss.geometry import SceneGeometry, infinity_of
from iibr_core.rendering.gloss.gloss_settings import GlossStroke, GlossSurface
from iibr_core.rendering.gloss.gloss_surface import fit_normals, surface_mask
from iibr_core.types import Disparity
from tests.iibr_core.rendering.gloss.scenes import GEOMETRY, SIZE, disparity_of, plane, sphere


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


def test_a_map_in_steps_has_smooth_normals():
    disparity, normals, hit = sphere()
    step = (disparity.max() - disparity.min()) / 255
    apart = degrees_apart(fit_normals(np.round(disparity / step) * step, GEOMETRY), normals)
    assert np.median(apart[hit]) < 4


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


@pytest.mark.parametrize("values", [(0.0, 1e30), (-1e30, 1e30), (1e-30, 2e-30)])
def test_wild_disparities_give_unit_normals(values):
    wild = np.random.default_rng(0).uniform(*values, (9, 9)).astype(np.float32)
    assert np.allclose(np.linalg.norm(fit_normals(wild, SceneGeometry(10.0, 0.0)), axis=-1), 1, atol=1e-3)


def test_depth_and_colour_choose_the_surface():
    disparity = np.tile(np.linspace(0, 10, 11, dtype=np.float32), (3, 1))
    photo = np.zeros((3, 11, 3), np.float32)
    photo[1] = (1, 0, 0)
    near_red = GlossSurface(farthest=0.55, color=(1, 0, 0), tolerance=0.1)
    mask = surface_mask(near_red, photo, disparity)
    assert mask[1].tolist() == [0] * 6 + [1] * 5
    assert not mask[[0, 2]].any()


def test_strokes_mark_and_erase_in_their_order():
    flat, photo = np.zeros((20, 40), np.float32), np.zeros((20, 40, 3), np.float32)
    across = GlossStroke(((0.25, 0.5), (0.75, 0.5)), 0.05)
    middle = GlossStroke(((0.5, 0.5),), 0.05, erases=True)
    mask = surface_mask(GlossSurface(strokes=(across, middle), strokes_only=True), photo, flat)
    y, x = np.mgrid[:20, :40]
    path = np.abs(y - 9.5) ** 2 + np.maximum(np.abs(x - 19.5) - 10, 0) ** 2 <= 4
    hole = (y - 9.5) ** 2 + (x - 19.5) ** 2 <= 4
    assert np.array_equal(mask > 0, path & ~hole)


def test_strokes_beyond_the_picture_mark_what_of_it_they_reach():
    flat, photo = np.zeros((10, 10), np.float32), np.zeros((10, 10, 3), np.float32)
    far = GlossStroke(((-0.9, -0.9),), 0.01)
    corner = GlossStroke(((-0.05, 0.05),), 0.2)
    mask = surface_mask(GlossSurface(strokes=(far, corner), strokes_only=True), photo, flat)
    assert mask[0, 0] == 1
    assert mask.sum() < 10


@pytest.mark.parametrize(
    ("values", "inverse_metres", "infinity"),
    [((1, 5), None, 0), ((-1, 3), None, -5), ((0, 9), (0.5, -1.0), 2), ((0, 9), (0.0, 1.0), 0), ((-2, -2), None, -2)],
)
def test_infinity_is_known_with_metres_and_else_a_guess(values, inverse_metres, infinity):
    given = Disparity(np.array([values], np.float32), "a map", inverse_metres=inverse_metres)
    assert infinity_of(given) == pytest.approx(infinity)


def test_rounding_from_pixel_to_pixel_does_not_show_in_the_normals_of_a_large_map():
    """Taps of large maps lie apart; a map that alternates must not have normals that do."""
    y, x = np.mgrid[:300, :700]
    rounded = (5 + 0.004 * x + 0.02 * ((x + y) % 2)).astype(np.float32)
    normals = fit_normals(rounded, SceneGeometry(600.0, 0.0))[40:-40, 40:-40]
    assert np.abs(np.diff(normals[..., 0], axis=1)).max() < 0.01
