"""Views of free cameras: against a slow twin, the views of the plane, and what is known of simple scenes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from iibr_core.beyond import free_view, landed_squares
from iibr_core.beyond.free_cameras import FreeViews
from iibr_core.beyond.free_view import render_free_view, target_from_photo
from iibr_core.beyond.landed_squares import CORNERS, SAMPLES
from iibr_core.method.rays import NO_MARGINS, rays_of_photo
from iibr_core.method.view import Renderer
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.types import Camera, ImageSize, ViewOffset
from tests.iibr_core.scenes import smooth_texture, square_before_wall


def camera(height, width, focal=60.0, place=(0.0, 0.0, 0.0), turned=None, **changes):
    size = ImageSize(height, width)
    middle = (width - 1) / 2, (height - 1) / 2
    axes = np.eye(3) if turned is None else turned
    return replace(Camera(axes, np.array(place, float), size, (focal, focal), middle, "test"), **changes)


def about(axis, degrees):
    """A turn about x (0), y (1) or z (2)."""
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
    """Colours and 1 / depth: a square at 1 before a wall at 3."""
    photo, disparity = square_before_wall(height, width, foreground=1.0, background=1 / 3)
    return photo.pixels, disparity.values


def sealed_step(matrix, x, y, d):
    """The step of disparity that moves where a pixel lands by three quarters of the size it lands at."""

    def landed(x, y, d):
        place = matrix @ (x, y, 1.0, d)
        return place[:2] / place[2]

    here, little = landed(x, y, d), 1e-6
    moved = np.abs(landed(x, y, d + little) - here).max()
    return 0.75 * max(np.abs(landed(x + i, y + j, d) - here).max() for i, j in ((little, 0), (0, little))) / moved


def drawn_slowly(disparity, matrix, size, rounding):
    """What `_draw` gives for one image: every sample asks every square of every pixel. rounding: so large steps are
    none.
    """
    height, width = disparity.shape
    nearest = np.full((SAMPLES * size.height, SAMPLES * size.width), -np.inf)
    at = (np.arange(SAMPLES * max(size)) + 0.5) / SAMPLES - 0.5
    for y, x in np.ndindex(height, width):
        corners, one_surface = [], max(sealed_step(matrix, x, y, disparity[y, x]), rounding)
        for j, i in CORNERS:
            # The pixels around the corner that steps below one_surface lead to from this one.
            alike, ways = {(y, x)}, [(y, x)]
            while ways:
                v, u = ways.pop()
                for next_v, next_u in ((y + j if v == y else y, u), (v, x + i if u == x else x)):
                    inside = 0 <= next_v < height and 0 <= next_u < width and (next_v, next_u) not in alike
                    if inside and abs(disparity[next_v, next_u] - disparity[v, u]) <= one_surface:
                        alike.add((next_v, next_u))
                        ways.append((next_v, next_u))
            mean = np.mean([disparity[place] for place in alike])
            landed = matrix @ (x + 0.5 * i, y + 0.5 * j, 1.0, mean)
            corners.append(landed[[0, 1, 3]] / landed[2])
        for b in (1, 2):
            triangle = np.array([corners[0], corners[b], corners[b + 1]])
            basis = np.vstack([triangle[:, :2].T, np.ones(3)])
            if np.linalg.det(basis) < 1e-9:
                continue
            for v, u in np.ndindex(nearest.shape):
                share = np.linalg.solve(basis, (at[u], at[v], 1.0))
                if share.min() >= -1e-6:
                    nearest[v, u] = max(nearest[v, u], share @ triangle[:, 2])
    return nearest


@pytest.mark.parametrize(("turn", "rounding"), [(about(2, 30.0), 0.0), (about(1, -8.0) @ about(0, 5.0), 0.9)])
def test_samples_see_what_a_slow_twin_sees(turn, rounding):
    rng = np.random.default_rng(1)
    disparity = np.where(rng.random((6, 7)) < 0.3, 2.0, 1.0) + rng.uniform(0, 0.3, (6, 7))
    photo = camera(6, 7, 8.0)
    target = camera(4, 5, 6.0, (0.2, -0.1, 0.15), turn)
    matrix = target_from_photo(photo, target, 8.0)
    rays = rays_of_photo(np.zeros((6, 7, 3), np.float32), disparity.astype(np.float32), 1.0, 0)
    flat = tuple(map(float, matrix.ravel()))
    landing = [landed_squares.rows_landed_on(rays, 0, flat)]
    nearest, source = landed_squares.draw_rays(rays, [flat], landing, 0.5, rounding, (0, 4), 5)
    slow = drawn_slowly(rays.arrays.disparity[0], matrix, target.size, rounding)
    # Samples on the very side of a triangle belong to either.
    differ = ~np.isclose(nearest, slow, atol=1e-4)
    assert differ.mean() < 0.01
    np.testing.assert_array_equal(source == 0, np.isneginf(nearest))


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
    with Renderer() as synthesis:
        known = synthesis.render(rays, offset)
    beside = camera(60, 80, place=(offset.s, offset.t, 0.0))
    view = render_free_view(rays, target_from_photo(camera(60, 80), beside, 60.0), beside.size, NO_MARGINS)
    alike = ~(view.occluded | known.occluded)
    difference = np.abs(view.colors - known.colors).max(axis=2)[alike]
    assert np.quantile(difference, 0.95) < 1e-3
    np.testing.assert_array_equal(np.isclose(view.disparity, known.disparity, atol=1e-3)[alike].mean() > 0.98, True)
    assert abs(view.occluded.mean() - known.occluded.mean()) < 0.01


def test_a_turned_camera_needs_no_disparity():
    texture = smooth_texture(48, 48)
    turned = camera(48, 48, turned=about(2, 90.0))
    for inverse_depth in (np.full((48, 48), 0.5), square_scene(48, 48)[1]):
        view = view_of(texture, inverse_depth, turned)
        np.testing.assert_allclose(view.colors, np.rot90(texture), atol=5e-3)


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


def test_a_surface_of_a_rounded_map_stays_closed_before_a_camera_that_moves_far():
    """A slope of stairs, and a wall far behind it, which stays apart."""
    rounded = np.tile(np.round(np.linspace(0.5, 1.0, 192, dtype=np.float32) * 50) / 50, (60, 1))
    rounded[:40] = 0.2
    view = view_of(smooth_texture(60, 192), rounded, camera(60, 192, place=(0.0, 0.0, 0.6)))
    assert not view.inpainted[55:].any()
    assert view.inpainted[:55].any()


def test_half_way_to_a_wall_it_is_twice_as_large():
    texture = smooth_texture(49, 49)
    view = view_of(texture, np.full((49, 49), 0.25), camera(49, 49, place=(0.0, 0.0, 2.0)))
    np.testing.assert_allclose(view.colors[::2, ::2], texture[12:37, 12:37], atol=2e-3)
    np.testing.assert_allclose(view.disparity, view.disparity[0, 0], rtol=1e-4)


def test_a_longer_lens_shows_the_middle():
    texture = smooth_texture(49, 49)
    view = view_of(texture, np.full((49, 49), 0.25), camera(49, 49, 120.0))
    np.testing.assert_allclose(view.colors[::2, ::2], texture[12:37, 12:37], atol=2e-3)


def test_a_smaller_picture_is_a_mean():
    fine = np.indices((48, 48)).sum(axis=0)[..., None] % 2 * np.ones(3)
    wide = camera(16, 16, 20.0)
    view = view_of(fine, np.full((48, 48), 0.25), wide)
    assert np.ptp(view.colors[2:-2, 2:-2]) < 0.3  # each third pixel would be black or white


def test_near_things_grow_faster_than_far_ones():
    pixels, inverse_depth = square_scene()
    before = (inverse_depth == 1.0).mean()
    view = view_of(pixels, inverse_depth, camera(40, 48, place=(0.0, 0.0, 0.3)))
    nearest = view.disparity > 0.9 * view.disparity.max()
    assert nearest.mean() == pytest.approx(before / 0.7**2, rel=0.1)


def test_what_was_hidden_is_of_the_wall():
    pixels, inverse_depth = square_scene()
    view = view_of(pixels, inverse_depth, camera(40, 48, place=(0.15, 0.0, 0.0)))
    hidden = view.inpainted & (np.indices(view.inpainted.shape)[1] < 40)
    assert hidden.sum() > 30
    assert (view.colors[hidden][:, 2] > view.colors[hidden][:, 0]).all()  # the wall is bluish, the square reddish


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


def test_a_single_pixel_is_seen():
    view = view_of(np.full((1, 1, 3), 0.5), [[0.5]], camera(1, 1, 1.0), camera(1, 1, 1.0))
    np.testing.assert_allclose(view.colors, 0.5, atol=1e-6)


def test_bands_do_not_show(monkeypatch):
    pixels, inverse_depth = square_scene()
    target = camera(40, 48, place=(0.1, 0.05, 0.1), turned=about(2, 20.0))
    whole = view_of(pixels, inverse_depth, target)
    monkeypatch.setattr(free_view, "MOST_BAND_PIXELS", 48 * SAMPLES**2 * 3)
    banded = view_of(pixels, inverse_depth, target)
    np.testing.assert_array_equal(whole.colors, banded.colors)


def test_it_can_be_cancelled():
    pixels, inverse_depth = square_scene()
    here = camera(40, 48)
    answers = iter([False] * 60)
    views = FreeViews(pixels, inverse_depth, here, [here])
    with pytest.raises(Cancelled), stoppable(lambda: next(answers, True)):
        [views.view(here) for _ in range(60)]


@pytest.mark.parametrize(("shown", "is_hidden"), [(1, False), (2, True), (0, True)])
def test_what_is_made_up_must_lie_clearly_before_what_the_photo_shows(shown, is_hidden):
    """Images 0 of the photo and 1 of inpainted rays have the sources 1 and 2; 0 is none."""
    corners = np.array([[[-1.0, -1.0, 1.2], [2.0, -1.0, 1.2], [2.0, 2.0, 1.2], [-1.0, 2.0, 1.2]]])
    nearest, source = np.full((SAMPLES, SAMPLES), 1.0, np.float32), np.full((SAMPLES, SAMPLES), shown, np.uint8)
    for ahead in (0.5, 0.1):
        landed_squares._draw_squares(corners, np.ones(1, np.bool_), np.ones(1), 2, 1, ahead, 0, nearest, source)
        assert (source == (3 if is_hidden or ahead < 0.2 else shown)).all()
