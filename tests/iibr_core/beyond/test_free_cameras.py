"""What cameras ask of a photo: its depth in their units, how far it goes on beyond its frame, what they cannot see."""

from __future__ import annotations

import numpy as np
import pytest

from iibr_core.beyond.free_cameras import (
    FARTHEST_STEPS,
    MAX_BEYOND,
    MAX_PARALLAX,
    FreeViews,
    fitted_cameras,
    inverse_depth_of,
    reach_of,
    steered,
)
from iibr_core.types import ImageSize, InputError
from tests.iibr_core.beyond.test_free_view import about, camera, square_scene


def test_depths_that_are_known_are_those_of_the_range():
    given = np.tile(np.linspace(5.0, 9.0, 50, dtype=np.float32), (40, 1))
    inverse_depth = inverse_depth_of(given, (2.0, 10.0))
    assert (inverse_depth.min(), inverse_depth.max()) == (pytest.approx(0.1), pytest.approx(0.5))
    steps = np.diff(inverse_depth[0, 5:-5])  # lone pixels at both ends do not count
    np.testing.assert_allclose(steps, steps[0], rtol=1e-4)


def test_else_the_nearest_is_one_away():
    given = np.repeat(np.float32([1.0, 2.0]), 30).reshape(6, 10)
    np.testing.assert_allclose(inverse_depth_of(given, None), given / 2)
    below_zero = inverse_depth_of(2 * given - 3, None)
    assert below_zero.max() == 1.0
    assert below_zero.min() == pytest.approx(1 / 20, rel=1e-4)


@pytest.mark.parametrize("depths", [None, (2.0, 10.0)])
@pytest.mark.parametrize("value", [0.0, -3.0, 1e30])
def test_what_is_flat_is_at_a_sensible_depth(value, depths):
    inverse_depth = inverse_depth_of(np.full((3, 4), value, np.float32), depths)
    assert (inverse_depth > 0).all()
    assert np.isfinite(inverse_depth).all()


def test_the_plane_is_looked_through_as_far_as_cameras_stand_beside():
    photo, beside = camera(40, 48), camera(40, 48, place=(0.2, -0.1, 0.0))
    reach = reach_of(photo, [photo, beside], (1.0, 3.0))
    assert reach.step == pytest.approx(0.2 / FARTHEST_STEPS)
    assert {(round(at.t, 6), round(at.s, 6)) for at in reach.outer} >= {(-2.0, 4.0), (-2.0, 0.0), (0.0, 4.0)}


def test_a_camera_far_beside_asks_for_half_a_picture_of_parallax_at_most():
    photo, beside = camera(40, 48), camera(40, 48, place=(0.9, 0.0, 0.0))
    reach = reach_of(photo, [photo, beside], (1.0, 3.0))
    # From 1 to 3 units away, a unit's move is 60 (1 - 1/3) px.
    assert 40 * FARTHEST_STEPS * reach.step == pytest.approx(MAX_PARALLAX * 48)
    assert max(at.s for at in reach.outer) == pytest.approx(FARTHEST_STEPS)


def test_a_turned_camera_asks_for_what_lies_beyond_the_frame():
    photo = camera(40, 48)
    margins = reach_of(photo, [camera(40, 48, turned=about(1, 10.0))], (1.0, 3.0)).margins
    assert margins.right >= 60 * np.tan(np.radians(10.0)) > 0 == margins.left
    wide = reach_of(photo, [camera(40, 48, 2.0)], (1.0, 3.0)).margins
    assert tuple(wide) == (MAX_BEYOND * 40,) * 2 + (MAX_BEYOND * 48,) * 2


def test_cameras_are_made_to_fit_a_smaller_photo_of_the_same_shape():
    """Copies are rounded; another shape is another picture."""
    given, other = camera(1000, 1200, focal=1500.0), camera(500, 800, focal=900.0)
    first, second = fitted_cameras([given, other], 0, ImageSize(101, 120))
    assert (first.size, second.size) == ((101, 120), (50, 80))
    assert first.focal_px[0] == pytest.approx(150)
    assert second.focal_px == (pytest.approx(90), pytest.approx(90))
    for height in (97, 103):
        with pytest.raises(InputError, match="its pictures are 1200x1000, the photo is 120x"):
            fitted_cameras([given, other], 0, ImageSize(height, 120))


@pytest.mark.parametrize(("right", "down"), [(0.6, 0.0), (-1.0, 0.0), (0.0, 0.7), (0.5, -0.8)])
def test_a_steered_camera_looks_where_it_is_told_and_stays_level(right, down):
    given = camera(40, 48, place=(1.0, 2.0, 3.0), turned=about(2, 20.0))
    found = steered(given, right, down, 0.5)
    np.testing.assert_allclose(found.position - given.position, given.world_from_camera @ (0, 0, 0.5), atol=1e-12)
    to_right, _, ahead = (given.world_from_camera.T @ found.world_from_camera).T
    assert to_right[1] == pytest.approx(0), "level"
    assert ahead[0] / ahead[2] == pytest.approx(right * 24 / 60)
    assert ahead[1] / np.hypot(ahead[0], ahead[2]) == pytest.approx(down * 20 / 60)


@pytest.mark.parametrize(
    "target",
    [
        camera(40, 48, turned=about(1, 180.0)),
        camera(40, 48, turned=about(0, 90.0)),
        camera(40, 48, place=(0.0, 0.0, 5.0)),
        camera(40, 48, place=(100.0, 0.0, 0.0)),
        camera(40, 48, place=(0.0, 0.0, 3.0)),
    ],
)
def test_a_camera_that_sees_nothing_of_the_photo_is_refused(target):
    pixels, inverse_depth = square_scene()
    with pytest.raises(InputError, match="test: sees nothing of the photo"):
        FreeViews(pixels, inverse_depth, camera(40, 48), [camera(40, 48), target])
