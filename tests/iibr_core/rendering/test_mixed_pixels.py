import numpy as np
import pytest

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.rendering.mixed_pixels import split_mixed_pixels

FRONT, BACK = np.float32([0.9, 0.6, 0.3]), np.float32([0.1, 0.2, 0.5])


def edge_photo(share):
    """Background left, foreground right, and one mixed column labelled as background at x = 5."""
    colors = np.tile(BACK, (9, 12, 1))
    colors[:, 6:] = FRONT
    colors[:, 5] = srgb_from_linear(share * linear_from_srgb(FRONT) + (1 - share) * linear_from_srgb(BACK))
    disparity = np.where(np.arange(12) < 6, 0.0, 2.0) * np.ones((9, 1))
    return colors, disparity.astype(np.float32)


@pytest.mark.parametrize("share", [0.1, 0.35, 0.5, 0.8, 1.0])
def test_a_mixed_pixel_splits_into_its_surfaces(share):
    own, fringe, fringe_disparity, coverage = split_mixed_pixels(*edge_photo(share), edge_step=0.5)
    assert coverage[4, 5] == pytest.approx(share, abs=1e-4)
    assert own[4, 5] == pytest.approx(BACK, abs=1e-3)
    assert fringe[4, 5] == pytest.approx(FRONT, abs=1e-3)
    assert fringe_disparity[4, 5] == 2.0


def test_both_parts_together_are_the_pixel_again():
    colors, disparity = edge_photo(0.4)
    noisy = np.clip(colors + np.random.default_rng(0).normal(0, 0.01, colors.shape), 0, 1).astype(np.float32)
    own, fringe, _, coverage = split_mixed_pixels(noisy, disparity, edge_step=0.5)
    share = coverage[..., None]
    together = srgb_from_linear(share * linear_from_srgb(fringe) + (1 - share) * linear_from_srgb(own))
    assert coverage[2:-2, 5].min() > 0.3
    assert together == pytest.approx(noisy, abs=1e-4)


def test_what_is_not_mixed_stays():
    colors, disparity = edge_photo(0.0)
    own, _, _, coverage = split_mixed_pixels(colors, disparity, edge_step=0.5)
    assert coverage.max() == 0
    assert (own == colors).all()
    flat = split_mixed_pixels(edge_photo(0.5)[0], np.zeros_like(disparity), edge_step=0.5)
    assert flat[3].max() == 0


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (2, 2), (4, 4)])
def test_tiny_photos(size):
    own, *_, coverage = split_mixed_pixels(np.ones((*size, 3), np.float32), np.ones(size, np.float32), 0.5)
    assert own.min() == 1
    assert coverage.max() == 0
