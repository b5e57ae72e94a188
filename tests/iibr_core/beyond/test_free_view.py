from dataclasses import replace
from itertools import product

import numpy as np
import pytest

from iibr_core.beyond import free_cameras
from iibr_core.beyond.free_view import render_free_view, target_from_photo
from iibr_core.inpainting.background import fill_background
from iibr_core.method.rays import NO_MARGINS, rays_of_photo
from iibr_core.method.view import Renderer
from iibr_core.runtime.work import watched
from iibr_core.types import Camera, ImageSize, InputError, ViewOffset
from tests.iibr_core.red_inpainter import paint_red
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
    return free_cameras.FreeViews(pixels, inverse_depth, photo, [target]).view(target)


def square_scene(height=40, width=48):
    """Return colours and 1 / depth of a square at 1 before a wall at 3."""
    photo, disparity = square_before_wall(height, width, foreground=1.0, background=1 / 3)
    return photo.pixels, disparity.values


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


def test_a_rough_surface_stays_closed_before_a_camera_that_hardly_moves():
    rough = 0.7 + np.random.default_rng(0).uniform(-0.04, 0.04, (40, 48)).astype(np.float32)
    rough[:, :5] = 0.2
    taken, near, far = (camera(40, 48, place=(step, 0.0, 0.0)) for step in (0.0, 0.1, 1.0))
    view = free_cameras.FreeViews(smooth_texture(40, 48), rough, taken, [near, far]).view(near)
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
    view = free_cameras.FreeViews(pixels, inverse_depth, here, [here, *beside]).view(here)
    np.testing.assert_allclose(view.colors[15:25, 5:15], pixels[15:25, 5:15], atol=2e-6)
    assert not view.inpainted.any()


@pytest.mark.parametrize("inpainter", [fill_background, None], ids=["once for all", "each view"])
def test_holes_show_what_lies_behind_and_never_the_foreground(inpainter):
    pixels, inverse_depth = square_scene()
    pixels[:], pixels[inverse_depth > 0.5] = (0.2, 0.2, 0.8), (0.9, 0.1, 0.1)
    here, beside = camera(40, 48), [camera(40, 48, place=(x, 0.0, 0.0)) for x in (-0.2, 0.2)]
    red = free_cameras.FreeViews(pixels, inverse_depth, here, [here, *beside], paint_red).view(beside[0])
    assert (red.colors == (1, 0, 0)).all(axis=2).any()
    views = free_cameras.FreeViews(pixels, inverse_depth, here, [here, *beside], inpainter)
    for view in map(views.view, beside):
        holes = view.inpainted[8:32, 14:34]
        assert holes.sum() > 20
        np.testing.assert_allclose(
            view.colors[8:32, 14:34][holes], np.tile((0.2, 0.2, 0.8), (holes.sum(), 1)), atol=0.02
        )


@pytest.mark.parametrize("place", [(0.0, 0.0, 0.999), (0.0, 0.0, 2.9999), (5.0, 0.0, -30.0), (1e-9, 0.0, 0.0)])
def test_wherever_it_stands_a_view_is_finite(place):
    pixels, inverse_depth = square_scene()
    noisy = inverse_depth * np.random.default_rng(0).uniform(0.5, 1.0, inverse_depth.shape)
    for disparity in (inverse_depth, noisy):
        view = view_of(pixels, disparity, camera(40, 48, place=place))
        assert np.isfinite(view.colors).all()
        assert np.isfinite(view.disparity).all()
    view = view_of(pixels, inverse_depth, camera(40, 48, place=(0.0, 0.0, 1.5)))
    assert view.disparity.max() < 1.01 * view.disparity[~view.inpainted].min(), "the wall alone, not what lies behind"


def test_depths_that_are_known_are_those_of_the_range_else_the_nearest_is_one_away():
    given = np.tile(np.linspace(5.0, 9.0, 50, dtype=np.float32), (40, 1))
    inverse_depth = free_cameras.inverse_depth_of(given, (2.0, 10.0))
    assert (inverse_depth.min(), inverse_depth.max()) == (pytest.approx(0.1), pytest.approx(0.5))
    steps = np.diff(inverse_depth[0, 5:-5])  # lone pixels at both ends do not count
    np.testing.assert_allclose(steps, steps[0], rtol=1e-4)
    given = np.repeat(np.float32([1.0, 2.0]), 30).reshape(6, 10)
    np.testing.assert_allclose(free_cameras.inverse_depth_of(given, None), given / 2)
    below_zero = free_cameras.inverse_depth_of(2 * given - 3, None)
    assert (below_zero.min(), below_zero.max()) == (pytest.approx(1 / 20, rel=1e-4), 1.0)
    for value, depths in product((0.0, -3.0, 1e30), (None, (2.0, 10.0))):
        flat = free_cameras.inverse_depth_of(np.full((3, 4), value, np.float32), depths)
        assert (flat > 0).all()
        assert np.isfinite(flat).all()


def test_rays_reach_as_far_as_cameras_stand_beside_or_turn():
    photo, beside = camera(40, 48), camera(40, 48, place=(0.2, -0.1, 0.0))
    reach = free_cameras.reach_of(photo, [photo, beside], (1.0, 3.0))
    assert reach.step == pytest.approx(0.2 / free_cameras.FARTHEST_STEPS)
    assert {(round(at.t, 6), round(at.s, 6)) for at in reach.outer} >= {(-2.0, 4.0), (-2.0, 0.0), (0.0, 4.0)}
    reach = free_cameras.reach_of(photo, [photo, camera(40, 48, place=(0.9, 0.0, 0.0))], (1.0, 3.0))
    # From 1 to 3 units away, a unit's move is 60 (1 - 1/3) px; half a picture of parallax at most.
    assert 40 * free_cameras.FARTHEST_STEPS * reach.step == pytest.approx(free_cameras.MAX_PARALLAX * 48)
    assert max(at.s for at in reach.outer) == pytest.approx(free_cameras.FARTHEST_STEPS)
    margins = free_cameras.reach_of(photo, [camera(40, 48, turned=about(1, 10.0))], (1.0, 3.0)).margins
    assert margins.right >= 60 * np.tan(np.radians(10.0)) > 0 == margins.left
    assert margins.top == margins.bottom < 10
    wide = free_cameras.reach_of(photo, [camera(40, 48, 2.0)], (1.0, 3.0)).margins
    assert tuple(wide) == (free_cameras.MAX_BEYOND * 40,) * 2 + (free_cameras.MAX_BEYOND * 48,) * 2


def test_cameras_are_made_to_fit_a_smaller_photo_of_the_same_shape():
    given, other = camera(1000, 1200, focal=1500.0), camera(500, 800, focal=900.0)
    first, second = free_cameras.fitted_cameras([given, other], 0, ImageSize(101, 120))
    assert (first.size, second.size) == ((101, 120), (50, 80))
    assert first.focal_px[0] == pytest.approx(150)
    assert second.focal_px == (pytest.approx(90), pytest.approx(90))
    for height in (97, 103):
        with pytest.raises(InputError, match="its pictures are 1200x1000, the photo is 120x"):
            free_cameras.fitted_cameras([given, other], 0, ImageSize(height, 120))


@pytest.mark.parametrize(("right", "down"), [(0.6, 0.0), (-1.0, 0.0), (0.0, 0.7), (0.5, -0.8)])
def test_a_steered_camera_looks_where_it_is_told_and_stays_level(right, down):
    given = camera(40, 48, place=(1.0, 2.0, 3.0), turned=about(2, 20.0))
    found = free_cameras.steered(given, right, down, 0.5)
    np.testing.assert_allclose(found.position - given.position, given.world_from_camera @ (0, 0, 0.5), atol=1e-12)
    to_right, _, ahead = (given.world_from_camera.T @ found.world_from_camera).T
    assert to_right[1] == pytest.approx(0), "level"
    assert ahead[0] / ahead[2] == pytest.approx(right * 24 / 60)
    assert ahead[1] / np.hypot(ahead[0], ahead[2]) == pytest.approx(down * 20 / 60)


@pytest.mark.parametrize(
    "target",
    [camera(40, 48, turned=about(1, 180.0)), camera(40, 48, turned=about(0, 90.0)),
     camera(40, 48, place=(0.0, 0.0, 5.0)), camera(40, 48, place=(100.0, 0.0, 0.0)),
     camera(40, 48, place=(0.0, 0.0, 3.0))],
)  # fmt: skip
def test_a_camera_that_sees_nothing_of_the_photo_is_refused(target):
    pixels, inverse_depth = square_scene()
    with pytest.raises(InputError, match="test: sees nothing of the photo"):
        free_cameras.FreeViews(pixels, inverse_depth, camera(40, 48), [camera(40, 48), target])


def test_a_slope_in_steps_is_closed_before_a_near_camera_and_the_work_is_reported():
    rounded = np.round(np.tile(np.linspace(0.4, 1.0, 97), (40, 1)) / 0.018).astype(np.float32) * np.float32(0.018)
    aside, said = camera(40, 97, place=(-0.9, 0.2, 0.2)), []
    with watched(lambda *progress: said.append(progress)):
        views = free_cameras.FreeViews(smooth_texture(40, 97), rounded, camera(40, 97), [aside])
    assert not views.view(aside).inpainted[10:30, 22:90].any()
    doing = "what cameras may see beside the photo's surfaces"
    assert said == [(done, len(said), doing) for done in range(1, len(said) + 1)]
    assert said
