"""The definition of the lens against slow twins: what a camera sees where, and what a picture of many of them is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from iibr_core.beyond.aperture_sampling import aperture_points, grid_weights
from iibr_core.beyond.lens import LensSum
from iibr_core.beyond.optics import CENTRE, HIGHLIGHT_GAIN, ApertureShape, Optics
from iibr_core.color import linear_from_srgb
from iibr_core.types import FloatImage, GridShape, ImageSize, ViewOffset
from tests.iibr_core.scenes import smooth_texture

SIZE = ImageSize(40, 56)
EYE = ViewOffset(0.4, -0.7)
CAMERA = ViewOffset(1.1, 0.5)
INSIDE = np.s_[10:-10, 10:-10]


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
    return np.stack([map_coordinates(light[..., c], places, order=3, mode="mirror") for c in range(3)], axis=-1)


def focus_of(optics: Optics) -> FloatImage:
    """Twin: the sharp disparity of each pixel."""
    y, x = np.indices(SIZE)
    right, lower = optics.focus_tilt
    across, down = (2 * x + 1) / SIZE.width - 1, (2 * y + 1) / SIZE.height - 1
    return np.asarray(optics.focus_disparity + right * across + lower * down, np.float32)


@pytest.mark.parametrize("tilt", [(0.0, 0.0), (1.5, 0.0), (0.0, -1.0), (0.5, 1.0)])
def test_a_camera_is_sheared_to_the_focus(tilt: tuple[float, float]) -> None:
    optics, view = Optics(EYE, focus_disparity=1.3, focus_tilt=tilt), smooth_texture(*SIZE)
    expected = sheared(view, focus_of(optics), (CAMERA.t - EYE.t, CAMERA.s - EYE.s))
    np.testing.assert_allclose(light_of(optics, (CAMERA, view))[INSIDE], expected[INSIDE], atol=0.01)


def test_within_the_focus_range_content_stays_where_the_eye_sees_it() -> None:
    """A wall at 2: its disparity is within the range, though not the focus; beyond it, it moves by the rest."""
    view, wall = smooth_texture(*SIZE), np.full(SIZE, 2.0, np.float32)
    optics = Optics(focus_disparity=1.0, focus_range=1.5)
    moved = sheared(view, wall, CAMERA)
    np.testing.assert_allclose(light_of(optics, (CAMERA, view), disparity=wall)[INSIDE], moved[INSIDE], atol=0.01)
    nearer = replace(optics, focus_range=0.4)
    expected = sheared(view, np.full(SIZE, 1.4, np.float32), CAMERA)
    np.testing.assert_allclose(light_of(nearer, (CAMERA, view), disparity=wall)[INSIDE], expected[INSIDE], atol=0.01)


@pytest.mark.parametrize("ratio", [-1.0, -0.5, 2.0])
def test_what_is_within_the_range_stays_so_where_all_disparities_are_scaled(ratio: float) -> None:
    """Also where depth is turned inside out."""
    view, wall = smooth_texture(*SIZE), np.full(SIZE, 1.2 * ratio, np.float32)
    optics = Optics(focus_disparity=0.5, focus_range=1.0).with_focus_scaled(ratio)
    moved = sheared(view, wall, CAMERA)
    np.testing.assert_allclose(light_of(optics, (CAMERA, view), disparity=wall)[INSIDE], moved[INSIDE], atol=0.01)


def test_clipped_pixels_and_exposure_count_for_more() -> None:
    view = np.full((*SIZE, 3), 0.5, np.float32)
    view[20, 30] = 1.0
    optics = Optics(aperture_diameter=2.0, highlight_recovery=1.0, exposure_stops=1.0)
    light = light_of(optics, (CENTRE, view))
    np.testing.assert_allclose(light[20, 30], 2 * (1 + HIGHLIGHT_GAIN), rtol=1e-4)
    np.testing.assert_allclose(light[5, 5], 2 * linear_from_srgb(view[5, 5]), rtol=1e-4)


def test_the_barrel_cuts_cameras_off_toward_the_corners() -> None:
    """A camera at the right of the lens, white among black ones: it shows where the barrel lies on its side."""
    optics = Optics(aperture_diameter=4.0, aperture_shape=ApertureShape("cat_eye", cat_eye=1.0))
    black, white = np.zeros((*SIZE, 3), np.float32), np.ones((*SIZE, 3), np.float32)
    light = light_of(optics, (ViewOffset(0.0, 1.9), white), (CENTRE, black))[..., 0]
    middle = SIZE.height // 2
    assert light[middle, -1] == pytest.approx(0.5, abs=1e-3)
    assert light[middle, 0] < 1e-3


def test_a_dot_out_of_focus_is_as_wide_as_the_aperture_asks() -> None:
    """Width of the blur = aperture times the distance from the focus; second moment of a disc: (diameter / 4)^2."""
    wide = ImageSize(101, 101)
    diameter, disparity = 3.0, 6.0
    lens = LensSum(Optics(aperture_diameter=diameter), wide)
    for t, s in aperture_points(ApertureShape(), diameter, 9.0, 200, 0):
        view = np.zeros((*wide, 3), np.float32)
        view[round(50 - disparity * t), round(50 - disparity * s)] = 1.0
        lens.add(ViewOffset(t, s), view)
    light = lens.light()[..., 0]
    y, x = np.indices(wide)
    moment = (light * ((y - 50) ** 2 + (x - 50) ** 2)).sum() / light.sum() / 2
    assert np.sqrt(moment) == pytest.approx(diameter * disparity / 4, rel=0.03)


def test_views_share_a_camera_bilinearly() -> None:
    grid = GridShape(3, 5)
    weights = grid_weights(np.array([[0.25, -0.5], [9.0, 9.0]]), ViewOffset(0.0, 1.0), grid)
    expected = np.zeros(grid)
    expected[1, 2:4], expected[2, 2:4] = 0.375, 0.125
    expected[2, 4] += 1  # beyond the grid its corner answers
    np.testing.assert_allclose(weights, expected)
    assert grid_weights(np.zeros((4, 2)), CENTRE, GridShape(1, 1)).tolist() == [[4.0]]
