from dataclasses import replace

import numpy as np
import pytest

from iibr_core.formats.maps.disparity_file import read_disparity
from iibr_core.method.occlusion import view_entropy
from iibr_core.method.plan import plan_for_viewing, plan_literal
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.view import Renderer
from iibr_core.types import GridShape, ViewOffset
from tests.iibr_core.scenes import by_index, disparity_of, generate, photo_of, smooth_texture, square_before_wall

HEIGHT, WIDTH = 20, 26
GRID = GridShape(3, 3)


def field_of(photo, disparity):
    """Return the views by index; every number of them is finite, no view is brighter than the photo but for ringing.

    Colours are stored as floats, because 8 bits would hide what is not finite.
    """
    plan = plan_literal(photo, disparity, GRID)
    views = by_index(list(generate(replace(photo, is_hdr=True), plan.field_disparity(disparity), plan)))
    assert len(views) == 9
    for view in views.values():
        assert view.colors.shape == (*photo.size, 3)
        assert np.isfinite(view.colors).all()
        assert np.isfinite(view.disparity).all()
        assert 0 <= view.colors.min() <= view.colors.max() <= 1.3 * photo.pixels.max() + 0.01
    return views


def plain_photo():
    return photo_of(smooth_texture(HEIGHT, WIDTH))


def test_disparity_all_equal():
    photo, disparity = plain_photo(), disparity_of(np.full((HEIGHT, WIDTH), 2.0))
    for (row, column), view in field_of(photo, disparity).items():
        shift = -2 * (row - 1), -2 * (column - 1)
        inside = np.zeros(photo.size, bool)
        inside[max(shift[0], 0) : HEIGHT + shift[0], max(shift[1], 0) : WIDTH + shift[1]] = True
        assert np.abs(view.colors - np.roll(photo.pixels, shift, axis=(0, 1)))[inside].max() <= 2e-3
        np.testing.assert_array_equal(view.inpainted, ~inside)
        assert view.disparity == pytest.approx(2.0)
    plan = plan_for_viewing(photo, disparity)
    assert plan.grid == (1, 1)
    assert not plan.has_disocclusion


def test_disparity_with_one_outlier_at_1e6(tmp_path):
    photo, values = plain_photo(), np.zeros((HEIGHT, WIDTH), np.float32)
    values[8, 9] = 1e6
    np.save(tmp_path / "map.npy", values)
    assert (read_disparity(tmp_path / "map.npy", photo.size).values == 0).all()
    far = np.ones(photo.size, np.bool_)
    far[2:15, 3:16] = False
    views = field_of(photo, disparity_of(values))
    del views[GRID.centre]
    for view in views.values():
        assert np.abs(view.colors - photo.pixels)[far].max() <= 2e-3
        assert np.abs(view.colors - photo.pixels).max() <= 0.1
        assert np.abs(view.disparity).max() <= 1
    assert plan_for_viewing(photo, disparity_of(values)).grid == (1, 1)


def test_disparity_larger_than_the_image():
    views = field_of(plain_photo(), disparity_of(np.full((HEIGHT, WIDTH), 500.0)))
    del views[GRID.centre]
    assert all(view.inpainted.all() and (view.colors == 0).all() for view in views.values())


@pytest.mark.parametrize("size", [(1, 1), (1, 13), (11, 1), (2, 2), (7, 13)])
def test_tiny_thin_and_prime_sized_images(size):
    photo = photo_of(np.random.default_rng(0).uniform(0, 1, (*size, 3)))
    disparity = disparity_of(np.random.default_rng(1).uniform(-2, 2, size))
    assert field_of(photo, disparity)[GRID.centre].colors == pytest.approx(photo.pixels, abs=1e-3)
    plan_for_viewing(photo, disparity)


def test_entropy_is_0_where_one_surface_shows_and_1_where_none_does():
    rays = rays_of_photo(plain_photo().pixels, np.full((HEIGHT, WIDTH), 3, np.float32), 1.0, 0)
    entropy = view_entropy(rays, ViewOffset(0.0, 1.0))
    assert entropy[:, : WIDTH - 3] == pytest.approx(0, abs=1e-5)
    assert entropy[:, WIDTH - 3 :] == pytest.approx(1, abs=1e-5)


@pytest.mark.parametrize("far", [1e2, 1e30])
def test_view_offset_far_outside_the_grid(far):
    photo, disparity = square_before_wall(HEIGHT, WIDTH)
    rays, square = rays_of_photo(photo.pixels, disparity.values, 1.0, 0), disparity.values > 0
    for offset in (ViewOffset(far, -far), ViewOffset(0.0, far)):
        view = Renderer().render(rays, offset)
        assert np.isfinite(view.colors).all()
        assert np.isfinite(view.disparity).all()
        assert (view.occluded == square).all()
        assert np.abs(view.colors - photo.pixels)[~square].max() <= 0.05


@pytest.mark.parametrize("upright", [True, False])
def test_a_one_pixel_wire(upright):
    values, pixels = np.zeros((24, 30)), np.full((24, 30, 3), 0.1)
    at = np.s_[:, 15] if upright else np.s_[12]
    values[at], pixels[at] = 3.0, 0.9
    view = field_of(photo_of(pixels), disparity_of(values))[(1, 2) if upright else (2, 1)]
    across = view.colors[8, :, 0] if upright else view.colors[:, 8, 0]
    place = 12 if upright else 9
    assert across[place] > 0.75
    assert np.delete(across, place).max() < 0.25
