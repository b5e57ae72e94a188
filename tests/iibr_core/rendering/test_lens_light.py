"""Views and pictures of a photo at its own size, tile by tile."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from iibr_core.generation.light_field import ray_set
from iibr_core.rendering import large_views
from iibr_core.rendering.flying_pixels import without_flying_pixels
from iibr_core.rendering.large_views import TILE_MARGIN_PX, LargePhoto, Part, tiles_of, views_of_tile, whole
from iibr_core.rendering.lens_light import LargeLens, LensSample, draw_large
from iibr_core.rendering.photo_rays import rays_of_photo
from iibr_core.rendering.resized_light import bring_to, mean_of_areas
from iibr_core.rendering.view_synthesis import ViewSynthesis
from iibr_core.runtime.tiling import Cancelled
from iibr_core.types import Disparity, ImageSize, Photo, ViewOffset, image_size
from tests.iibr_core.scenes import literal_plan, smooth_texture, square_before_wall

OFFSET = ViewOffset(0.6, -1.5)


def large(height: int = 96, width: int = 120, foreground: float = 3.0) -> LargePhoto:
    photo, disparity = square_before_wall(height, width, foreground=foreground)
    return LargePhoto(photo.pixels, disparity.values)


def linear(encoded: np.ndarray) -> np.ndarray:
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)


def test_tiles_cover_a_part_once() -> None:
    part, seen = Part(3, 50, 7, 61), np.zeros((64, 64), int)
    for tile in tiles_of(part, 20):
        seen[tile.slices] += 1
        assert max(tile.size) <= 20
    assert seen.sum() == seen[part.slices].sum() == seen[part.slices].size


@pytest.mark.parametrize("side", [24, 40])
def test_a_view_in_tiles_is_the_view_made_at_once(side: int) -> None:
    photo = large()
    with ViewSynthesis() as synthesis:
        rays = rays_of_photo(photo.pixels, photo.disparity, 1.5, 0)
        expected = synthesis.render(rays, OFFSET)
        seen = np.empty_like(photo.pixels)
        for tile in tiles_of(whole(photo.size), side):
            (view,) = views_of_tile(photo, tile, [OFFSET], synthesis)
            seen[tile.slices] = view.colors
    colors = without_flying_pixels(rays, OFFSET, expected.colors, expected.disparity, expected.inpainted)
    # Holes are filled tile by tile; flying pixels beside them depend on that.
    known = ~ndimage.binary_dilation(expected.occluded, np.ones((3, 3)))
    assert known.mean() > 0.85
    assert np.abs(seen - colors)[known].max() < 0.02


def test_holes_show_what_the_smaller_light_field_shows() -> None:
    photo, disparity = square_before_wall(48, 60, foreground=1.5)
    red = Photo(np.tile(np.float32([0.9, 0.1, 0.1]), (48, 60, 1)), 50.0, "red")
    plan = literal_plan(photo, disparity, 3)
    rays, outer = ray_set(photo, disparity, plan)
    views = dict(outer)
    # Every inpainted ray is made red: so the larger photo's holes are.
    rays.arrays.colors[rays.photo_images : len(rays)] = red.pixels
    large_photo = LargePhoto(*(np.repeat(np.repeat(a, 2, 0), 2, 1) for a in (photo.pixels, 2 * disparity.values)), rays)
    offset = ViewOffset(-1.0, -1.0)
    with ViewSynthesis() as synthesis:
        (view,) = views_of_tile(large_photo, whole(large_photo.size), [offset], synthesis)
    hole = views[offset].occluded
    assert hole.sum() > 20
    shown = view.colors[::2, ::2][hole]
    assert (np.abs(shown - red.pixels[0, 0]).max(axis=1) < 0.05).mean() > 0.8


def test_a_pinhole_in_the_middle_gives_the_photo_back() -> None:
    photo = large()
    with ViewSynthesis() as synthesis:
        light = draw_large(photo, LargeLens(), Part(5, 70, 11, 100), synthesis)
    np.testing.assert_allclose(light, linear(photo.pixels)[5:70, 11:100], atol=2e-3)


def test_what_is_in_focus_is_sharp_and_all_else_is_as_in_the_smaller_picture() -> None:
    photo = large(foreground=0.0)
    photo.disparity[:, 60:] = 4.0
    samples = tuple(LensSample(ViewOffset(t, s), 0.25) for t in (-1.0, 1.0) for s in (-1.0, 1.0))
    lens = LargeLens(samples=samples, share=1.0, diameter=4.0, sharp_up_to_px=(2.0, 4.0))
    smaller = np.full((48, 60, 3), 0.3, np.float32)
    smaller[:, :30] = mean_of_areas(linear(photo.pixels).astype(np.float32), ImageSize(48, 60))[:, :30]
    with ViewSynthesis() as synthesis:
        light = draw_large(photo, lens, whole(photo.size), synthesis, smaller)
    np.testing.assert_allclose(light[8:-8, 8:40], linear(photo.pixels)[8:-8, 8:40], atol=0.01)
    np.testing.assert_allclose(light[8:-8, 72:-8], 0.3, atol=0.01)


@pytest.mark.parametrize("part", [Part(0, 63, 0, 85), Part(10, 51, 20, 67)])
def test_light_brought_to_a_smaller_picture_equals_it_made_smaller(part: Part) -> None:
    size, light = ImageSize(63, 85), np.zeros((*part.size, 3), np.float32)
    wanted = smooth_texture(63, 85)
    smaller = mean_of_areas(wanted, ImageSize(25, 34))
    bring_to(light, smaller, part, size)
    np.testing.assert_allclose(light[4:-4, 4:-4], wanted[part.slices][4:-4, 4:-4], atol=0.02)


def test_the_mean_of_areas_is_a_box_filter() -> None:
    light = np.random.default_rng(0).random((6, 8, 3)).astype(np.float32)
    expected = light.reshape(3, 2, 4, 2, 3).mean(axis=(1, 3))
    np.testing.assert_allclose(mean_of_areas(light, ImageSize(3, 4)), expected, rtol=1e-5)
    assert mean_of_areas(light, image_size(light)) is light


def test_drawing_is_cancelled_between_bands() -> None:
    with ViewSynthesis(lambda: True) as synthesis, pytest.raises(Cancelled):
        draw_large(large(), LargeLens(ViewOffset(0.0, 1.0)), Part(0, 20, 0, 20), synthesis, should_stop=lambda: True)


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (13, 1)])
def test_tiny_photos_and_huge_parallax(size: tuple[int, int], monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(large_views, "TILE_PX", 4)
    photo = LargePhoto(smooth_texture(*size), Disparity(np.full(size, 1e6, np.float32), "far").values)
    lens = LargeLens(ViewOffset(0.0, 1.0), (LensSample(ViewOffset(1.0, 1.0), 1.0),), 0.5, 1.5)
    with ViewSynthesis() as synthesis:
        light = draw_large(photo, lens, whole(photo.size), synthesis, np.ones((1, 1, 3), np.float32))
    assert np.isfinite(light).all()


def test_the_mean_of_a_part_counts_the_shares_of_its_border() -> None:
    light = np.random.default_rng(3).random((5, 6, 3), np.float32)
    fine = light.repeat(4, 0).repeat(4, 1)
    part = mean_of_areas(light, ImageSize(3, 4), area=(0.5, 1.25, 3.0, 4.0))
    expected = fine[2:14, 5:21].reshape(3, 4, 4, 4, 3).mean((1, 3))
    np.testing.assert_allclose(part, expected, rtol=1e-5)


def test_progress_counts_the_pixels_that_are_read_for_a_tile() -> None:
    told: list[tuple[float, float]] = []
    with ViewSynthesis() as synthesis:
        photo = large(20, 1100, foreground=3.0)
        draw_large(photo, LargeLens(), whole(photo.size), synthesis, report_progress=lambda *now: told.append(now[:2]))
    first, second = 20 * (1024 + TILE_MARGIN_PX + 3), 20 * (1100 - 1024 + TILE_MARGIN_PX + 3)
    assert told == [(first, first + second), (first + second, first + second)]
