"""Views of free cameras: against the views of the plane, and what is known of simple scenes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from iibr_core.beyond import free_view
from iibr_core.beyond.free_cameras import FreeViews
from iibr_core.beyond.free_view import render_free_view, target_from_photo
from iibr_core.beyond.landed_squares import SAMPLES
from iibr_core.method.rays import NO_MARGINS, rays_of_photo
from iibr_core.method.view import Renderer
from iibr_core.types import Camera, ImageSize, ViewOffset
from tests.iibr_core.scenes import smooth_texture, square_before_wall


def camera(height, width, focal=60.0, place=(0.0, 0.0, 0.0), turned=None, **changes):
    size = ImageSize(height, width)
    middle = (width - 1) / 2, (height - 1) / 2
    axes = np.eye(3) if turned is None else turned
    return replace(Camera(axes, np.array(place, float), size, (focal, focal), middle, "test"), **changes)


def about(axis, degrees):
    """Return a turn about x (0), y (1) or z (2)."""
    angle, i, j = np.radians(degrees), (axis + 1) % 3, (axis + 2) % 3
    matrix = np.eye(3)
    matrix[i, i] = matrix[j, j] = np.cos(angle)
    matrix[j, i], matrix[i, j] = np.sin(angle), -np.sin(angle)
    return matrix


def view_of(pixels, inverse_depth, target, photo=None):
    pixels, inverse_depth = np.asarray(pixels, np.float32), np.asarray(inverse_depth, np.float32)
    photo = photo or camera(*inverse_depth.shape)
    return FreeViews(pixels, inverse_depth, photo, [target]).view(target)


def square_scene(height=40, width=48):
    """Return colours and 1 / depth of a square at 1 before a wall at 3."""
    photo, disparity = square_before_wall(height, width, foreground=1.0, background=1 / 3)
    return photo.pixels, disparity.values


def test_the_photos_own_camera_gives_the_photo():
    pixels, inverse_depth = square_scene()
    view = view_of(pixels, inverse_depth, camera(40, 48))
    np.testing.assert_allclose(view.colors, pixels, atol=2e-6)
    assert not view.occluded.any()
    assert not view.inpainted.any()


def test_a_camera_beside_sees_the_fields_view():
    photo, disparity = square_before_wall(60, 80, foreground=2.0, background=1.0)
    offset = ViewOffset(-1.5, 2.25)
    rays = rays_of_photo(photo.pixels, disparity.values, 4.0, 0)
    known = Renderer().render(rays, offset)
    beside = camera(60, 80, place=(offset.s, offset.t, 0.0))
    view = render_free_view(rays, target_from_photo(camera(60, 80), beside, 60.0), beside.size, NO_MARGINS)
    alike = ~(view.occluded | known.occluded)
    difference = np.abs(view.colors - known.colors).max(axis=2)[alike]
    assert np.quantile(difference, 0.95) < 1e-3
    assert np.isclose(view.disparity, known.disparity, atol=1e-3)[alike].mean() > 0.98
    assert abs(view.occluded.mean() - known.occluded.mean()) < 0.01


def test_depth_edges_are_looked_up_as_anything_where_the_camera_only_turns():
    """Also in a ray set that is made for other cameras, which move."""
    rough = smooth_texture(48, 48) + np.random.default_rng(2).uniform(-0.15, 0.15, (48, 48, 3)).astype(np.float32)
    taken, beside = camera(48, 48), camera(48, 48, place=(0.3, 0.2, 0.0))
    turned = camera(48, 48, turned=about(2, 10.0) @ about(1, 2.0))
    scenes = np.full((48, 48), 0.5, np.float32), square_scene(48, 48)[1]
    flat, square = (FreeViews(rough, inverse, taken, [turned, beside]).view(turned) for inverse in scenes)
    apart = np.abs(flat.colors - square.colors).max(axis=2)[~(flat.inpainted | square.inpainted)]
    # Pixels around the square are split, and looked up in two parts.
    assert apart.max() < 0.05
    assert (apart > 1e-3).mean() < 0.15


def test_a_rough_surface_stays_closed_before_a_camera_that_hardly_moves():
    """Also in a ray set that is made for other cameras, which move far."""
    rough = 0.7 + np.random.default_rng(0).uniform(-0.04, 0.04, (40, 48)).astype(np.float32)
    rough[:, :5] = 0.2
    taken, near, far = (camera(40, 48, place=(step, 0.0, 0.0)) for step in (0.0, 0.1, 1.0))
    view = FreeViews(smooth_texture(40, 48), rough, taken, [near, far]).view(near)
    assert not view.inpainted[5:35, 10:40].any()


@pytest.mark.parametrize("target", [camera(49, 49, place=(0.0, 0.0, 2.0)), camera(49, 49, 120.0)])
def test_half_way_to_a_wall_or_through_a_lens_twice_as_long_it_is_twice_as_large(target):
    texture = smooth_texture(49, 49)
    view = view_of(texture, np.full((49, 49), 0.25), target)
    np.testing.assert_allclose(view.colors[::2, ::2], texture[12:37, 12:37], atol=2e-3)
    np.testing.assert_allclose(view.disparity, view.disparity[0, 0], rtol=1e-4)


def test_what_is_made_up_never_hides_what_the_photo_shows():
    pixels, inverse_depth = square_scene()
    inverse_depth[20, 10] = 0.2  # a hole in the wall: filled, in views from beside, by the wall
    here, beside = camera(40, 48), [camera(40, 48, place=(x, y, 0.0)) for x in (-0.2, 0.2) for y in (-0.2, 0.2)]
    view = FreeViews(pixels, inverse_depth, here, [here, *beside]).view(here)
    np.testing.assert_allclose(view.colors[15:25, 5:15], pixels[15:25, 5:15], atol=2e-6)
    assert not view.inpainted.any()


def test_what_lies_behind_the_camera_is_not_drawn():
    pixels, inverse_depth = square_scene()
    view = view_of(pixels, inverse_depth, camera(40, 48, place=(0.0, 0.0, 1.5)))
    assert np.isfinite(view.colors).all()
    assert view.disparity.max() < 1.01 * view.disparity[~view.inpainted].min()  # the wall alone


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.999), (0.0, 0.0, 2.9999), (5.0, 0.0, -30.0), (1e-9, 0.0, 0.0)])
def test_wherever_it_stands_a_view_is_finite(place):
    pixels, inverse_depth = square_scene()
    noisy = inverse_depth * np.random.default_rng(0).uniform(0.5, 1.0, inverse_depth.shape)
    for disparity in (inverse_depth, noisy):
        view = view_of(pixels, disparity, camera(40, 48, place=place))
        assert np.isfinite(view.colors).all()
        assert np.isfinite(view.disparity).all()


def test_bands_do_not_show(monkeypatch):
    pixels, inverse_depth = square_scene()
    target = camera(40, 48, place=(0.1, 0.05, 0.1), turned=about(2, 20.0))
    whole = view_of(pixels, inverse_depth, target)
    monkeypatch.setattr(free_view, "MOST_BAND_PIXELS", 48 * SAMPLES**2 * 3)
    banded = view_of(pixels, inverse_depth, target)
    np.testing.assert_array_equal(whole.colors, banded.colors)
