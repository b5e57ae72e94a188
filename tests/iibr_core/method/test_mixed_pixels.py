import numpy as np
import pytest

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.method.flying_pixels import (
    without_flying_pixels,
)
from iibr_core.method.mixed_pixels import split_mixed_pixels
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.view import Renderer, View
from iibr_core.types import ViewOffset

FOREGROUND, BACK = np.float32([0.9, 0.6, 0.3]), np.float32([0.1, 0.2, 0.5])


def edge_photo(share):
    """Return background left, foreground right, and one mixed column labelled as background at x = 5."""
    colors = np.tile(BACK, (9, 12, 1))
    colors[:, 6:] = FOREGROUND
    colors[:, 5] = srgb_from_linear(share * linear_from_srgb(FOREGROUND) + (1 - share) * linear_from_srgb(BACK))
    disparity = np.where(np.arange(12) < 6, 0.0, 2.0) * np.ones((9, 1))
    return colors, disparity.astype(np.float32)


def shares_of(scale, turn=0):
    """Return the shares of a photo of greys, times a scale for each channel, which are turned round."""
    colors, disparity = edge_photo(0.35)
    light = linear_from_srgb(colors) * np.random.default_rng(0).uniform(0.5, 1.5, (9, 12, 1)).astype(np.float32)
    bright = np.roll(srgb_from_linear(light * np.float32(scale)), turn, axis=2)
    return split_mixed_pixels(bright, disparity, edge_step=0.5)[3]


def test_shares_are_those_of_a_darker_photo_however_bright_an_hdr_one_is():
    """Channels spread alike: what is left of their covariances after rounding is no colour."""
    np.testing.assert_allclose(shares_of(1e7), shares_of(1.0), atol=3e-3)
    for turn in (1, 2):
        np.testing.assert_allclose(shares_of([1e7, 1e5, 1e4], turn), shares_of([1e7, 1e5, 1e4]), atol=3e-3)


@pytest.mark.parametrize(
    ("behind", "beside", "is_split"),
    [(0.0, 0.0, True), (-0.4, 0.0, True), (-1.4, 0.0, False), (0.0, 0.5, False)],
    ids=["an edge", "before a halo of the background", "on a slope", "resampled to a ramp"],
)
def test_pixels_behind_an_edge_are_split_but_not_on_a_slope(behind, beside, is_split):
    """A fall behind a pixel that is much less than the step in front of it makes no slope."""
    colors, disparity = edge_photo(0.5)
    disparity[:, :5], disparity[:, 5] = behind, beside
    disparity[:, 6] -= beside
    assert (split_mixed_pixels(colors, disparity, edge_step=0.45)[3][4, 5] > 0) == is_split


OFFSET = ViewOffset(-0.5, 1.5)


def without(colors, view, rays, offset=OFFSET, threads=1):
    detail = rays.photo_detail
    return without_flying_pixels(colors, view.disparity, view.inpainted, detail, offset, rays.margins, threads)


@pytest.mark.parametrize(("gap_px", "is_torn"), [(1.5, False), (2.5, True)])
def test_only_steps_that_open_a_gap_tear_rays_off(gap_px, is_torn) -> None:
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
def test_the_photos_own_view_stays(size) -> None:
    rng = np.random.default_rng(3)
    photo, values = rng.random((*size, 3)).astype(np.float32), rng.integers(0, 3, size).astype(np.float32)
    nothing = np.zeros(size, np.bool_)
    view = View(photo, values, nothing, nothing)
    assert (without(photo, view, rays_of_photo(photo, values, 1.0, 0), ViewOffset(0.0, 0.0)) == photo).all()
