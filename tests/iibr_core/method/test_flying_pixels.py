"""Flying pixels are found and taken out; what stands out in the photo, too, stays."""

from __future__ import annotations

import numpy as np
import pytest
from scipy import ndimage

from iibr_core.color import encoded_from_stored, stored_from_encoded
from iibr_core.method.flying_pixels import CALM, STANDS_OUT, STANDS_OUT_FACTOR, measure_detail, without_flying_pixels
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.view import Renderer, View
from iibr_core.types import ViewOffset
from tests.iibr_core.scenes import smooth_texture

OFFSET = ViewOffset(-0.5, 1.5)


def median(colors: np.ndarray) -> np.ndarray:
    return ndimage.median_filter(colors, (3, 3, 1), mode="nearest")


def without(colors, view, rays, offset=OFFSET, threads=1):
    detail = rays.photo_detail
    return without_flying_pixels(colors, view.disparity, view.inpainted, detail, offset, rays.margins, threads)


def slowly(colors: np.ndarray, view: View, detail: np.ndarray) -> np.ndarray:
    """Do the same pixel by pixel, to views of a photo without margins."""
    replaced, medians = colors.copy(), median(colors)
    last = np.subtract(detail.shape, 1)
    for y, x in np.argwhere(~view.inpainted):
        v, u = np.clip(np.array([y, x]) + view.disparity[y, x] * np.array(OFFSET), 0, last)
        own = ndimage.map_coordinates(detail.astype(float), [[v], [u]], order=1, mode="nearest")[0]
        is_torn = detail[int(v + 0.5), int(u + 0.5)] < CALM
        if is_torn and np.abs(colors[y, x] - medians[y, x]).max() > STANDS_OUT + STANDS_OUT_FACTOR * own:
            replaced[y, x] = medians[y, x]
    return replaced


def test_the_kernel_is_its_slow_twin() -> None:
    rng = np.random.default_rng(5)
    photo = np.clip(smooth_texture(30, 40) + rng.normal(0, 0.01, (30, 40, 3)), 0, 1).astype(np.float32)
    np.testing.assert_allclose(measure_detail(photo), np.abs(photo - median(photo)).max(-1), atol=1e-6)
    values = np.where((np.indices((30, 40)) // 9).sum(0) % 2, 2.0, 0.5).astype(np.float32)
    rays = rays_of_photo(photo, values, 1.5, 0)
    view = Renderer().render(rays, OFFSET)
    colors = np.where(rng.random((30, 40, 1)) < 0.1, rng.random((30, 40, 3)), view.colors).astype(np.float32)
    replaced = without(colors, view, rays)
    np.testing.assert_allclose(replaced, slowly(colors, view, rays.photo_detail), atol=1e-5)
    assert (replaced != colors).any()
    for is_hdr in (False, True):
        stored = stored_from_encoded(colors, is_hdr)
        expected = slowly(encoded_from_stored(stored), view, rays.photo_detail)
        replaced = without(stored, view, rays, threads=2)
        assert replaced.dtype == stored.dtype
        np.testing.assert_array_equal(replaced, stored_from_encoded(expected, is_hdr))


@pytest.mark.parametrize(("gap_px", "is_torn"), [(1.5, False), (2.5, True)])
def test_only_steps_that_open_a_gap_tear_rays_off(gap_px: float, is_torn: bool) -> None:
    """A lone odd pixel of a view beside a step that is so wide there; or far from it, where it never goes."""
    photo = np.full((20, 30, 3), 0.5, np.float32)
    values = np.where(np.arange(30) < 15, 0.0, gap_px).astype(np.float32) * np.ones((20, 1), np.float32)
    colors, still, shown = photo.copy(), np.zeros((20, 30), np.float32), np.zeros((20, 30), np.bool_)
    colors[10, 14], colors[10, 6] = 0.9, 0.9
    made = without(colors, View(colors, still, shown, shown), rays_of_photo(photo, values, 1.0, 0), ViewOffset(0, 1.0))
    assert (made[10, 14] == 0.5).all() == is_torn
    assert (made[10, 6] == colors[10, 6]).all()


def test_a_thin_wire_stays() -> None:
    photo = np.full((40, 60, 3), 0.8, np.float32)
    values = np.zeros((40, 60), np.float32)
    rows, columns = np.arange(40), np.arange(40) // 2 + 15
    photo[rows, columns], values[rows, columns] = 0.1, 3.0
    rays, offset = rays_of_photo(photo, values, 1.5, 0), ViewOffset(0.0, 1.0)
    view = Renderer().render(rays, offset)
    replaced = without(view.colors, view, rays, offset)
    wire = view.disparity > 2.5
    assert wire.sum() >= 38
    assert (replaced[wire] == view.colors[wire]).all()


@pytest.mark.parametrize("size", [(20, 30), (1, 1), (1, 7), (2, 2)])
def test_the_photos_own_view_stays(size: tuple[int, int]) -> None:
    rng = np.random.default_rng(3)
    photo, values = rng.random((*size, 3)).astype(np.float32), rng.integers(0, 3, size).astype(np.float32)
    nothing = np.zeros(size, np.bool_)
    view = View(photo, values, nothing, nothing)
    assert (without(photo, view, rays_of_photo(photo, values, 1.0, 0), ViewOffset(0.0, 0.0)) == photo).all()
