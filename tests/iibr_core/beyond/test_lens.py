from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from iibr_core.beyond.aperture_sampling import aperture_points, grid_weights, views_in_aperture
from iibr_core.beyond.lens import LensSum
from iibr_core.beyond.optics import ApertureMask, ApertureShape, Optics
from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.types import CENTRE, FloatImage, GridShape, ImageSize, ViewOffset
from tests.iibr_core.scenes import smooth_texture

SIZE = ImageSize(40, 56)
EYE = ViewOffset(0.4, -0.7)
CAMERA = ViewOffset(1.1, 0.5)


def light_of(optics: Optics, *views: tuple[ViewOffset, FloatImage], disparity: FloatImage | None = None) -> FloatImage:
    lens = LensSum(optics, SIZE)
    for offset, colors in views:
        lens.add(offset, colors, disparity=disparity)
    return lens.light()


def sheared(view: FloatImage, by: FloatImage, camera: tuple[float, float]) -> FloatImage:
    """Twin: linear light of a view where the picture's pixels look, moved by a disparity (H, W)."""
    y, x = np.indices(SIZE)
    places = [y - by * camera[0], x - by * camera[1]]
    light = linear_from_srgb(view)
    return np.stack([map_coordinates(light[..., c], places, order=3, mode="reflect") for c in range(3)], axis=-1)


def focus_of(optics: Optics) -> FloatImage:
    """Twin: the sharp disparity of each pixel."""
    y, x = np.indices(SIZE)
    right, lower = optics.focus_tilt
    across, down = (2 * x + 1) / SIZE.width - 1, (2 * y + 1) / SIZE.height - 1
    return np.asarray(optics.focus_disparity + right * across + lower * down, np.float32)


@pytest.mark.parametrize("focus", [1.3, 6.3, -6.3])
@pytest.mark.parametrize("tilt", [(0.0, 0.0), (1.5, 0.0), (0.0, -1.0), (0.5, 1.0)])
def test_a_camera_is_sheared_to_the_focus_and_mirrored_at_its_borders(tilt, focus) -> None:
    optics, view = Optics(EYE, focus_disparity=focus, focus_tilt=tilt), smooth_texture(*SIZE)
    expected = sheared(view, focus_of(optics), (CAMERA.t - EYE.t, CAMERA.s - EYE.s))
    np.testing.assert_allclose(light_of(optics, (CAMERA, view)), expected, atol=0.01)


def test_light_above_white_counts_as_it_is_and_recovery_adds_none():
    """HDR views are not clipped: a lamp 12 times as bright as white in half of the views is 6 times as bright."""
    bright, dark = (np.full((*SIZE, 3), srgb_from_linear(np.float32(level)), np.float32) for level in (12.0, 0.0))
    for recovery in (0.0, 1.0):
        lens = LensSum(Optics(aperture_diameter=2.0, highlight_recovery=recovery), SIZE, is_hdr=True)
        lens.add(CENTRE, bright)
        lens.add(CENTRE, dark)
        np.testing.assert_allclose(lens.light(), 6.0, rtol=1e-4)


@pytest.mark.parametrize(("diameter", "factor"), [(0.0, 1.0), (0.5, 8.5), (1.0, 16.0), (9.0, 16.0)])
def test_recovery_makes_clipped_light_up_to_16_times_as_bright(diameter, factor):
    """Less in a lens that is nearly closed, in which nothing blooms; twice all that by a stop of exposure."""
    lens = LensSum(Optics(aperture_diameter=diameter, highlight_recovery=1.0, exposure_stops=1.0), SIZE)
    lens.add(CENTRE, np.ones((*SIZE, 3), np.float32))
    np.testing.assert_allclose(lens.light(), 2 * factor, rtol=1e-4)
    half = np.full((*SIZE, 3), 0.5, np.float32)
    np.testing.assert_allclose(
        light_of(Optics(highlight_recovery=1.0), (CENTRE, half)), linear_from_srgb(half), rtol=1e-4
    )


def test_the_barrel_cuts_cameras_off_toward_the_corners() -> None:
    """A camera at the right of the lens, white among black ones: it shows where the barrel lies on its side."""
    optics = Optics(aperture_diameter=4.0, aperture_shape=ApertureShape("cat_eye", cat_eye=1.0))
    black, white = np.zeros((*SIZE, 3), np.float32), np.ones((*SIZE, 3), np.float32)
    light = light_of(optics, (ViewOffset(0.0, 1.9), white), (CENTRE, black))[..., 0]
    middle = SIZE.height // 2
    assert light[middle, -1] == pytest.approx(0.5, abs=1e-3)
    assert light[middle, 0] < 1e-3


def test_views_share_a_camera_bilinearly() -> None:
    grid = GridShape(3, 5)
    weights = grid_weights(np.array([[0.25, -0.5], [9.0, 9.0]]), ViewOffset(0.0, 1.0), grid)
    expected = np.zeros(grid)
    expected[1, 2:4], expected[2, 2:4] = 0.375, 0.125
    expected[2, 4] += 1  # beyond the grid its corner answers
    np.testing.assert_allclose(weights, expected)
    assert grid_weights(np.zeros((4, 2)), CENTRE, GridShape(1, 1)).tolist() == [[4.0]]


CROSS = ApertureShape("mask", mask=ApertureMask("cross", 3, 3, bytes([0, 255, 0, 255, 255, 255, 0, 255, 0])))
CORNER = ApertureShape("mask", mask=ApertureMask("corner", 2, 2, bytes([255, 255, 255, 0])))
DISC = ApertureShape()
FROM_GEOMETRY = [
    (DISC, (0.0, 0.0), 1 / 4),
    (ApertureShape("polygon", blades=6), (0.0, 0.0), (2 + np.cos(2 * np.pi / 6)) / 12),
    (ApertureShape("polygon", blades=3), (0.0, 0.0), (2 + np.cos(2 * np.pi / 3)) / 12),
    (ApertureShape("ring", ring_inner=0.5), (0.0, 0.0), (1 + 0.5**2) / 4),
    (CROSS, (0.0, 0.0), (2 / 3) ** 2 * (1 / 12 + 2 / 5)),
    (CORNER, (-1 / 6, -1 / 6), 1 / 3 - 1 / 36),
    (replace(CORNER, rotation_deg=90.0), (-1 / 6, 1 / 6), 1 / 3 - 1 / 36),
]
"""Shape; for a radius of 1: centre (t, s) and second moment about it per axis."""
UNLIMITED = 99.0


@pytest.mark.parametrize("case", FROM_GEOMETRY)
@pytest.mark.parametrize("diameter", [0.3, 3.0])
@pytest.mark.parametrize("count", [4, 12, 64])
def test_cameras_have_centre_and_width_of_the_opening(case, diameter, count) -> None:
    (shape, centre, moment), radius = case, diameter / 2
    points = aperture_points(shape, diameter, UNLIMITED, count)
    assert points.mean(0) == pytest.approx(radius * np.array(centre), abs=0.01 * radius)
    assert np.mean((points - points.mean(0)) ** 2) == pytest.approx(radius**2 * moment, rel=0.02)


@pytest.mark.parametrize("count", [3, 6, 33])
def test_no_camera_stands_outside_a_thin_ring(count) -> None:
    distances = np.hypot(*aperture_points(ApertureShape("ring", ring_inner=0.95), 2.0, UNLIMITED, count).T)
    assert distances.min() > 0.85
    assert distances.max() <= 1 + 1e-9


def test_an_empty_mask_is_a_pinhole_in_the_middle() -> None:
    closed = ApertureShape("mask", mask=ApertureMask("closed", 2, 2, bytes(4)))
    assert np.array_equal(aperture_points(closed, 3.0, UNLIMITED, 20), np.zeros((1, 2)))
    assert views_in_aperture(closed, 3.0, CENTRE, GridShape(1, 3)).tolist() == [[0.0, 1.0, 0.0]]


@pytest.mark.parametrize("diameter", [7.5, 20.0, 99.0, 1e30])
def test_an_aperture_beyond_the_grid_is_the_grids_square(diameter) -> None:
    points = aperture_points(DISC, diameter, 5.0, 64)
    assert np.mean(points**2) == pytest.approx(5**2 / 12, rel=0.02)
    assert np.abs(points).max() < 2.5 + 0.15


@pytest.mark.parametrize("case", FROM_GEOMETRY)
def test_views_in_an_aperture_have_its_centre_and_width(case) -> None:
    """Views a step apart show a camera as a tent does, whose second moment is 1/6."""
    (shape, centre, moment), radius, grid = case, 4.0, GridShape(11, 13)
    weights = views_in_aperture(shape, 2 * radius, ViewOffset(0.5, -0.25), grid)
    assert weights.sum() == pytest.approx(1)
    places = np.argwhere(weights > 0) - np.array(grid.centre) - (0.5, -0.25)
    weights = weights[weights > 0]
    middle = weights @ places
    assert middle == pytest.approx(radius * np.array(centre), abs=0.02 * radius)
    spread = weights @ ((places - middle) ** 2).sum(axis=-1) / 2
    assert spread == pytest.approx(radius**2 * moment + 1 / 6, rel=0.03)
