import numpy as np
import pytest
from scipy import ndimage

from iibr_core.beyond.full_size import LargePhoto, Part, tiles_of, views_of_tile, whole
from iibr_core.formats.images.resized_light import mean_of_areas
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.view import Renderer, finish
from iibr_core.types import ImageSize, ViewOffset
from tests.iibr_core.scenes import square_before_wall

OFFSET = ViewOffset(0.6, -1.5)


def large(height: int = 96, width: int = 120, foreground: float = 3.0) -> LargePhoto:
    photo, disparity = square_before_wall(height, width, foreground=foreground)
    return LargePhoto(photo.pixels, disparity.values)


def test_tiles_cover_a_part_once() -> None:
    part, seen = Part(3, 50, 7, 61), np.zeros((64, 64), int)
    for tile in tiles_of(part, 20):
        seen[tile.slices] += 1
        assert max(tile.size) <= 20
    assert seen.sum() == seen[part.slices].sum() == seen[part.slices].size


@pytest.mark.parametrize("side", [24, 40])
def test_a_view_in_tiles_is_the_view_made_at_once(side) -> None:
    photo = large()
    renderer, rays = Renderer(), rays_of_photo(photo.pixels, photo.disparity, 1.5, 0)
    expected = finish(rays, OFFSET, renderer.render(rays, OFFSET))
    seen = np.empty_like(photo.pixels)
    for tile in tiles_of(whole(photo.size), side):
        (view,) = views_of_tile(photo, tile, [OFFSET], renderer)
        seen[tile.slices] = view.colors
    # Holes are filled tile by tile; flying pixels beside them depend on that.
    known = ~ndimage.binary_dilation(expected.occluded, np.ones((3, 3)))
    assert known.mean() > 0.85
    assert np.abs(seen - expected.colors)[known].max() < 0.02


def test_the_mean_of_a_part_counts_the_shares_of_its_border() -> None:
    light = np.random.default_rng(3).random((5, 6, 3), np.float32)
    fine = light.repeat(4, 0).repeat(4, 1)
    part = mean_of_areas(light, ImageSize(3, 4), area=(0.5, 1.25, 3.0, 4.0))
    expected = fine[2:14, 5:21].reshape(3, 4, 4, 4, 3).mean((1, 3))
    np.testing.assert_allclose(part, expected, rtol=1e-5)
