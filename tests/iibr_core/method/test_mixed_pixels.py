import numpy as np
import pytest

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.method import mixed_pixels
from iibr_core.method.mixed_pixels import split_mixed_pixels

FOREGROUND, BACK = np.float32([0.9, 0.6, 0.3]), np.float32([0.1, 0.2, 0.5])


def edge_photo(share):
    """Background left, foreground right, and one mixed column labelled as background at x = 5."""
    colors = np.tile(BACK, (9, 12, 1))
    colors[:, 6:] = FOREGROUND
    colors[:, 5] = srgb_from_linear(share * linear_from_srgb(FOREGROUND) + (1 - share) * linear_from_srgb(BACK))
    disparity = np.where(np.arange(12) < 6, 0.0, 2.0) * np.ones((9, 1))
    return colors, disparity.astype(np.float32)


@pytest.mark.parametrize("share", [0.1, 0.35, 0.5, 0.8])
def test_a_mixed_pixel_splits_into_its_surfaces(share):
    own, fringe, fringe_disparity, coverage = split_mixed_pixels(*edge_photo(share), edge_step=0.5)
    assert coverage[4, 5] == pytest.approx(share, abs=2e-3)
    assert own[4, 5] == pytest.approx(BACK, abs=6e-3)
    assert fringe[4, 5] == pytest.approx(FOREGROUND, abs=2e-3)
    assert fringe_disparity[4, 5] == 2.0


def test_shares_are_those_of_a_darker_photo_however_bright_an_hdr_one_is():
    """Of greys, whose channels spread alike: what is left of their covariances after rounding is no colour."""
    colors, disparity = edge_photo(0.35)
    light = linear_from_srgb(colors) * np.random.default_rng(0).uniform(0.5, 1.5, (9, 12, 1)).astype(np.float32)
    usual, bright = (
        split_mixed_pixels(srgb_from_linear(light * np.float32(scale)), disparity, edge_step=0.5)[3]
        for scale in (1.0, 1e7)
    )
    np.testing.assert_allclose(bright, usual, atol=3e-3)


@pytest.mark.parametrize("turn", [1, 2])
def test_shares_of_a_bright_photo_do_not_depend_on_which_channel_is_brightest(turn):
    colors, disparity = edge_photo(0.35)
    light = linear_from_srgb(colors) * np.random.default_rng(0).uniform(0.5, 1.5, (9, 12, 1)).astype(np.float32)
    bright = srgb_from_linear(light * np.float32([1e7, 1e5, 1e4]))
    expected = split_mixed_pixels(bright, disparity, edge_step=0.5)[3]
    found = split_mixed_pixels(np.roll(bright, turn, axis=2), disparity, edge_step=0.5)[3]
    np.testing.assert_allclose(found, expected, atol=3e-3)


def test_a_pixel_that_is_all_foreground_goes_with_it():
    _, fringe, _, coverage = split_mixed_pixels(*edge_photo(1.0), edge_step=0.5)
    assert coverage[4, 5] == pytest.approx(1 - mixed_pixels.LEAST_MATTE)
    assert fringe[4, 5] == pytest.approx(FOREGROUND, abs=1e-2)


def test_where_colors_tell_nothing_the_outline_tells_the_share():
    _, disparity = edge_photo(0.5)
    own, fringe, _, coverage = split_mixed_pixels(np.tile(BACK, (9, 12, 1)), disparity, edge_step=0.5)
    straight_edge = 3 * mixed_pixels.OUTLINE_SHARE
    assert coverage[4] == pytest.approx(np.where(np.arange(12) == 5, straight_edge, 0.0))
    assert np.stack([own, fringe]) == pytest.approx(np.broadcast_to(BACK, (2, 9, 12, 3)), abs=1e-5)


def test_splits_are_the_most_likely_ones():
    """Pixel by pixel: weighted means and covariances of both surfaces, and Bayesian matting of what lies between."""
    rng = np.random.default_rng(3)
    colors = (0.1 + 0.8 * rng.random((13, 15, 3))).astype(np.float32)
    disparity = (2.0 * (rng.random((13, 15)) < 0.15)).astype(np.float32)
    disparity[:, 9:] = 2.0
    disparity[6, 4] = np.nan
    own, fringe, fringe_disparity, coverage = split_mixed_pixels(colors, disparity, edge_step=0.5)
    split = 0
    for y, x in np.ndindex(13, 15):
        expected = obvious_split(colors, disparity, y, x)
        if expected is None:
            assert coverage[y, x] == 0
            assert np.isnan(fringe_disparity[y, x])
            continue
        split += 1
        assert fringe_disparity[y, x] == 2.0
        assert coverage[y, x] == pytest.approx(expected[0], abs=1e-3)
        assert own[y, x] == pytest.approx(expected[1], abs=1e-2)
        assert fringe[y, x] == pytest.approx(expected[2], abs=1e-2)
    assert split > 40


def obvious_split(colors, disparity, y, x):
    """Share, own and fringe colour of a pixel, None where it is not split; surfaces are 2 apart."""
    v, u = np.mgrid[: len(disparity), : disparity.shape[1]]
    beside = (abs(v - y) <= 1) & (abs(u - x) <= 1)
    window = (abs(v - y) <= mixed_pixels.MATTING_PX) & (abs(u - x) <= mixed_pixels.MATTING_PX) & ((v != y) | (u != x))
    in_front, behind = disparity == 2.0, disparity == 0.0
    if not (behind[y, x] and (in_front & beside).any() and (behind & window).any()):
        return None
    outline = mixed_pixels.OUTLINE_SHARE * (in_front & beside).sum()
    is_edge_band = np.array(
        [
            any(abs(disparity[max(j - 1, 0) : j + 2, max(i - 1, 0) : i + 2].reshape(-1) - disparity[j, i]) > 0.5)
            for j, i in np.ndindex(disparity.shape)
        ]
    ).reshape(disparity.shape)
    weight = np.exp(-((v - y) ** 2 + (u - x) ** 2) / 12.5) * np.where(is_edge_band, mixed_pixels.EDGE_BAND_TRUST, 1.0)
    light = linear_from_srgb(colors).astype(np.float64)
    means, spreads = [], []
    for surface in (behind, in_front):
        part = weight * surface * window / (weight * surface * window).sum()
        means.append((part[..., None] * light).sum((0, 1)))
        off = light - means[-1]
        spread = np.einsum("yx,yxc,yxe->ce", part, off, off)
        spreads.append(spread + mixed_pixels.COLOR_VARIANCE * (1 + np.trace(spread)) * np.eye(3))
    share, contrast = outline, means[1] - means[0]
    for _ in range(mixed_pixels.MATTING_ROUNDS):
        precision = np.linalg.inv((1 - share) ** 2 * spreads[0] + share**2 * spreads[1])
        fits = 1 / mixed_pixels.SHARE_DEVIATION**2 + contrast @ precision @ contrast
        expected = outline / mixed_pixels.SHARE_DEVIATION**2 + contrast @ precision @ (light[y, x] - means[0])
        share = np.clip(expected / fits, 0, 1 - mixed_pixels.LEAST_MATTE)
    if share < mixed_pixels.LEAST_MATTE:
        return None
    precision = np.linalg.inv((1 - share) ** 2 * spreads[0] + share**2 * spreads[1])
    off = precision @ (light[y, x] - means[0] - share * contrast)
    background = means[0] + (1 - share) * spreads[0] @ off
    foreground = means[1] + share * spreads[1] @ off
    around = light[behind & window | (v == y) & (u == x)]
    background, foreground = np.where(foreground < 0, light[y, x] / (1 - share), background), np.maximum(foreground, 0)
    bounded = np.clip(background, around.min(axis=0), around.max(axis=0))
    foreground = np.where(bounded == background, foreground, (light[y, x] - (1 - share) * bounded) / share)
    return share, srgb_from_linear(bounded), srgb_from_linear(foreground)


def test_both_parts_together_are_the_pixel_again():
    colors, disparity = edge_photo(0.4)
    noisy = np.clip(colors + np.random.default_rng(0).normal(0, 0.01, colors.shape), 0, 1).astype(np.float32)
    own, fringe, _, coverage = split_mixed_pixels(noisy, disparity, edge_step=0.5)
    share = coverage[..., None]
    together = srgb_from_linear(share * linear_from_srgb(fringe) + (1 - share) * linear_from_srgb(own))
    assert coverage[2:-2, 5].min() > 0.3
    assert together == pytest.approx(noisy, abs=1e-4)


@pytest.mark.parametrize("here", [0.95, 0.05])
def test_what_is_behind_is_neither_brighter_nor_darker_than_its_surface_all_around(here):
    colors, disparity = edge_photo(1.0)
    colors[:, :5] = np.random.default_rng(1).uniform(0.2, 0.8, (9, 5, 3))
    colors[4, 5] = here
    own = split_mixed_pixels(colors, disparity, edge_step=0.5)[0]
    colors[disparity > 0] = colors[4, 5]
    assert own[4, 5].max() <= colors.max() + 1e-6
    assert own[4, 5].min() >= colors.min() - 1e-6


def test_what_is_not_mixed_stays():
    colors, disparity = edge_photo(0.0)
    own, _, _, coverage = split_mixed_pixels(colors, disparity, edge_step=0.5)
    assert coverage.max() == 0
    assert (own == colors).all()
    flat = split_mixed_pixels(edge_photo(0.5)[0], np.zeros_like(disparity), edge_step=0.5)
    assert flat[3].max() == 0


@pytest.mark.parametrize(("fall", "is_split"), [(0.0, True), (0.4, True), (1.4, False)])
def test_on_a_slope_nothing_is_split(fall, is_split):
    """What falls away behind a pixel by much less than the step in front of it is a halo of the background."""
    colors, disparity = edge_photo(0.5)
    disparity[:, :5] -= fall
    assert (split_mixed_pixels(colors, disparity, edge_step=0.5)[3][4, 5] > 0) == is_split


def test_an_edge_that_resampling_has_made_a_ramp_is_not_split():
    """Twice as large, with values between both surfaces': such a pixel falls away half as far as it rises."""
    colors, disparity = edge_photo(0.5)
    disparity[:, 4:8] = 0.0, 0.5, 1.5, 2.0
    assert split_mixed_pixels(colors, disparity, edge_step=0.3)[3][4, 5] == 0
    assert mixed_pixels._foreground_beside(disparity, 4, 5, 0.3) == (0.5, 0.0)
    assert mixed_pixels._foreground_beside(disparity, 4, 4, 0.3)[0] == 0.5, "before a ramp it is flat"


@pytest.mark.parametrize("size", [(1, 1), (1, 7), (2, 2), (4, 4)])
def test_tiny_photos(size):
    own, *_, coverage = split_mixed_pixels(np.ones((*size, 3), np.float32), np.ones(size, np.float32), 0.5)
    assert own.min() == 1
    assert coverage.max() == 0
