import numpy as np
import pytest
from scipy import ndimage

from iibr_core.color import encoded_from_stored, linear_from_srgb, srgb_from_linear, stored_from_encoded
from iibr_core.method import mixed_pixels
from iibr_core.method.flying_pixels import (
    STANDS_OUT,
    STANDS_OUT_FACTOR,
    UNREACHED_DETAIL,
    measure_detail,
    without_flying_pixels,
)
from iibr_core.method.mixed_pixels import move_with_foreground, split_mixed_pixels
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.view import Renderer, View
from iibr_core.surfaces import SLOPE_SHARE
from iibr_core.types import ViewOffset
from tests.iibr_core.scenes import smooth_texture

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
    """Return share, own and fringe colour of a pixel, None where it is not split; surfaces are 2 apart."""
    v, u = np.mgrid[: len(disparity), : disparity.shape[1]]
    beside = (abs(v - y) <= 1) & (abs(u - x) <= 1)
    window = (abs(v - y) <= mixed_pixels.MATTING_PX) & (abs(u - x) <= mixed_pixels.MATTING_PX) & ((v != y) | (u != x))
    in_front, behind = disparity == 2.0, disparity == 0.0
    if not (behind[y, x] and (in_front & beside).any() and (behind & window).any()):
        return None
    outline = mixed_pixels.OUTLINE_SHARE * (in_front & beside).sum()
    around = (disparity[max(j - 1, 0) : j + 2, max(i - 1, 0) : i + 2] for j, i in np.ndindex(disparity.shape))
    steps = [(abs(values - here) > 0.5).any() for values, here in zip(around, disparity.flat)]
    is_edge_band = np.reshape(steps, disparity.shape)
    weight = np.exp(-((v - y) ** 2 + (u - x) ** 2) / 12.5) * np.where(is_edge_band, mixed_pixels.EDGE_BAND_WEIGHT, 1.0)
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
        share = np.clip(expected / fits, 0, 1 - mixed_pixels.MIN_MATTE)
    if share < mixed_pixels.MIN_MATTE:
        return None
    precision = np.linalg.inv((1 - share) ** 2 * spreads[0] + share**2 * spreads[1])
    off = precision @ (light[y, x] - means[0] - share * contrast)
    background = means[0] + (1 - share) * spreads[0] @ off
    foreground = means[1] + share * spreads[1] @ off
    seen = light[behind & window | (v == y) & (u == x)]
    background, foreground = np.where(foreground < 0, light[y, x] / (1 - share), background), np.maximum(foreground, 0)
    bounded = np.clip(background, seen.min(axis=0), seen.max(axis=0))
    foreground = np.where(bounded == background, foreground, (light[y, x] - (1 - share) * bounded) / share)
    return share, srgb_from_linear(bounded), srgb_from_linear(foreground)


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


STEPS = (0.1, 1.0)


def test_pixels_move_as_the_slow_way_says():
    values, shares = np.float32([0, 0.03, 0.3, 0.5, 0.9, 2, np.nan]), [0.5, 0.1, 0.1, 0.1, 0.1, 0.05, 0.05]
    disparity = np.random.default_rng(5).choice(values, (23, 31), p=shares)
    found, count = move_with_foreground(disparity, STEPS), 0
    for y, x in np.ndindex(disparity.shape):
        expected = slowly(disparity, y, x)
        np.testing.assert_equal(found[y, x], expected)
        count += expected > disparity[y, x]
    assert count > 50


def slowly(disparity, y, x):
    def at(v, u):
        return disparity[np.clip(v, 0, disparity.shape[0] - 1), np.clip(u, 0, disparity.shape[1] - 1)]

    ways = [(-1, 0), (0, -1), (0, 1), (1, 0)]
    beside = [(at(y + v, x + u), at(y + 2 * v, x + 2 * u)) for v, u in ways]
    known = [pair for pair in beside if not np.isnan(pair[0])]
    here = disparity[y, x]
    if not known or np.isnan(here):
        return here
    foreground = max(near for near, _ in known)
    beyond = next(far for near, far in known if near == foreground)
    step = foreground - here
    if not STEPS[0] < step <= STEPS[1]:
        return here
    falls_away = here - min(near for near, _ in known) > SLOPE_SHARE * step
    goes_on = beyond - foreground > SLOPE_SHARE * step
    return here if falls_away or goes_on else foreground


OFFSET = ViewOffset(-0.5, 1.5)


def median(colors: np.ndarray) -> np.ndarray:
    return ndimage.median_filter(colors, (3, 3, 1), mode="nearest")


def without(colors, view, rays, offset=OFFSET, threads=1):
    detail = rays.photo_detail
    return without_flying_pixels(colors, view.disparity, view.inpainted, detail, offset, rays.margins, threads)


def replaced_slowly(colors: np.ndarray, view: View, detail: np.ndarray) -> np.ndarray:
    """Do the same pixel by pixel, to views of a photo without margins."""
    replaced, medians = colors.copy(), median(colors)
    last = np.subtract(detail.shape, 1)
    for y, x in np.argwhere(~view.inpainted):
        v, u = np.clip(np.array([y, x]) + view.disparity[y, x] * np.array(OFFSET), 0, last)
        own = ndimage.map_coordinates(detail.astype(float), [[v], [u]], order=1, mode="nearest")[0]
        is_torn = detail[int(v + 0.5), int(u + 0.5)] < UNREACHED_DETAIL
        if is_torn and np.abs(colors[y, x] - medians[y, x]).max() > STANDS_OUT + STANDS_OUT_FACTOR * own:
            replaced[y, x] = medians[y, x]
    return replaced


def test_the_kernel_is_its_slow_twin() -> None:
    rng = np.random.default_rng(5)
    photo = np.clip(smooth_texture(30, 40) + rng.normal(0, 0.01, (30, 40, 3)), 0, 1).astype(np.float32)
    torn = rng.random((30, 40)) < 0.5
    expected = np.where(torn, np.abs(photo - median(photo)).max(-1), UNREACHED_DETAIL)
    np.testing.assert_allclose(measure_detail(photo, torn), expected, atol=1e-6)
    values = np.where((np.indices((30, 40)) // 9).sum(0) % 2, 2.0, 0.5).astype(np.float32)
    rays = rays_of_photo(photo, values, 1.5, 0)
    view = Renderer().render(rays, OFFSET)
    colors = np.where(rng.random((30, 40, 1)) < 0.1, rng.random((30, 40, 3)), view.colors).astype(np.float32)
    replaced = without(colors, view, rays)
    np.testing.assert_allclose(replaced, replaced_slowly(colors, view, rays.photo_detail), atol=1e-5)
    assert (replaced != colors).any()
    for is_hdr in (False, True):
        stored = stored_from_encoded(colors, is_hdr)
        expected = replaced_slowly(encoded_from_stored(stored), view, rays.photo_detail)
        replaced = without(stored, view, rays, threads=2)
        assert replaced.dtype == stored.dtype
        np.testing.assert_array_equal(replaced, stored_from_encoded(expected, is_hdr))


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
