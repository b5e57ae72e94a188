import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from iibr_core.depth.edges.blur import extent, measure_edge_blur
from iibr_core.depth.edges.fit import _find_missing, fit_to_blur
from iibr_core.depth.edges.line import gradient, height_at
from iibr_core.depth.edges.lone import _find_lone, fill_lone
from iibr_core.training.degradation import blur
from tests.iibr_core.depth.edges.test_refine import disc_before_slope
from tests.iibr_core.scenes import smooth_texture


def test_heights_are_bilinear_and_the_border_goes_on():
    values = np.random.default_rng(0).normal(0, 1, (5, 7)).astype(np.float32)
    places = np.random.default_rng(1).uniform(-2, 9, (60, 2))
    found = [height_at(values, x, y) for y, x in places]
    expected = map_coordinates(values.astype(float), places.T, order=1, mode="nearest")
    np.testing.assert_allclose(found, expected, atol=1e-6)
    assert height_at(values, 6.0, 4.0) == values[4, 6]


def test_gradients_of_planes_are_exact():
    y, x = np.mgrid[:9, :11].astype(np.float32)
    np.testing.assert_allclose(gradient(0.5 * x - 0.25 * y, 5, 4), (0.5, -0.25), atol=1e-6)
    # Rows and columns are alike.
    bumpy = np.random.default_rng(2).normal(0, 1, (9, 9)).astype(np.float32)
    assert gradient(bumpy, 3, 6) == pytest.approx(gradient(bumpy.T.copy(), 6, 3)[::-1], abs=1e-6)


RED, BLUE = np.float32([0.8, 0.1, 0.1]), np.float32([0.1, 0.2, 0.8])
NEAR, FAR, EDGE = 9.0, 2.0, 0.3


def disc(size=64):
    """Return a photo of a red disc before a blue wall, slightly noisy, and its disparity."""
    y, x = np.mgrid[:size, :size]
    inside = (x - size / 2) ** 2 + (y - size / 2) ** 2 < (size / 4) ** 2
    photo = np.where(inside[..., None], RED, BLUE) + np.random.default_rng(5).normal(0, 0.01, (size, size, 3))
    return photo.astype(np.float32), np.where(inside, NEAR, FAR).astype(np.float32)


def test_lone_disparities_get_those_of_their_colour():
    photo, truth = disc()
    given = 0.5 * (truth + np.roll(truth, 1, axis=1))
    filled, holes = fill_lone(photo, given, np.zeros(truth.shape, np.bool_), EDGE)
    assert (np.abs(given - truth) > 1).sum() > 50
    assert (np.abs(filled - truth) > 1).sum() == 0
    assert (holes == (filled != given)).all()


def test_a_lone_pixel_is_none_of_its_surfaces_but_a_thin_thing_is_one():
    values = np.full((40, 40), FAR, np.float32)
    values[:, 21:] = NEAR
    values[10, 20] = 5.0
    lone, between = _find_lone(values, EDGE)
    assert np.argwhere(lone).tolist() == [[10, 20]]
    assert between == 1
    values[11, 20:22] = values[12, 19:22] = values[13:, 19:22] = 5.0
    assert not _find_lone(values, EDGE)[0].any()


SIGMA, FIT_EDGE = 2.0, 0.12


def scene() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a photo, its exact disparity and one with an outline that is wrong by a pixel, here and there."""
    photo, exact, _ = disc_before_slope(120)
    rng, places = np.random.default_rng(5), np.mgrid[:120, :120]
    shifts = [np.rint(blur(rng.normal(size=(120, 120)).astype(np.float32), 1.0) * 4).clip(-1, 1) for _ in "yx"]
    y, x = (places + shifts).clip(0, 119).astype(int)
    return photo, exact, exact[y, x]


def wrong_side(fitted: np.ndarray, exact: np.ndarray) -> int:
    return int(np.count_nonzero((fitted > 1.2) != (exact > 1.2)))


def test_ragged_outlines_become_whole() -> None:
    photo, exact, start = scene()
    fitted = fit_to_blur(photo, blur(exact, SIGMA), start, SIGMA, FIT_EDGE)
    assert wrong_side(start, exact) > 80
    assert wrong_side(fitted, exact) < 0.1 * wrong_side(start, exact)


def test_the_missing_part_is_the_map_minus_the_blurred_one() -> None:
    _, _, exact = scene()
    taps = np.exp(-0.5 * (np.arange(-6, 7) / SIGMA) ** 2)
    taps = (taps / taps.sum()).astype(np.float32)
    missing = np.empty_like(exact)
    _find_missing(np.zeros_like(exact), exact, taps, 0, 120, missing)
    padded = np.pad(exact, 6, mode="edge")
    for y, x in ((0, 0), (50, 36), (119, 119)):
        assert -missing[y, x] == pytest.approx(taps @ padded[y : y + 13, x : x + 13] @ taps, abs=1e-5)


@pytest.mark.parametrize(
    ("sigma", "size", "measured"), [(1.0, 160, 1.0), (4.0, 160, 4.0), (8.0, 180, 8.0), (8.0, 140, 0), (0.0, 160, 0)]
)
def test_the_blur_of_a_map_is_measured_unless_it_is_exact_or_too_small(sigma, size, measured) -> None:
    photo, disparity, _ = disc_before_slope(size)
    soft = blur(disparity, sigma) if sigma else disparity
    np.testing.assert_allclose(measure_edge_blur(photo, soft), measured, rtol=0.15)


def parts_blurred(*sigmas: float) -> float:
    """The blur measured on a disc, three times side by side, whose map is blurred differently in each part."""
    photo, disparity, _ = disc_before_slope(160)
    maps = [blur(np.tile(disparity, (1, 3)), sigma) if sigma else np.tile(disparity, (1, 3)) for sigma in sigmas]
    disparity = np.concatenate([values[:, k * 160 : (k + 1) * 160] for k, values in enumerate(maps)], 1)
    return measure_edge_blur(np.tile(photo, (1, 3, 1)), disparity)


def test_a_map_has_the_blur_of_its_soft_edges() -> None:
    assert parts_blurred(0, 1.5, 2.0) == pytest.approx(1.75, rel=0.2)
    assert parts_blurred(2.0, 0, 2.0) == pytest.approx(2.0, rel=0.15)


def test_an_edge_that_the_photo_does_not_share_proves_nothing() -> None:
    photo, disparity, _ = disc_before_slope(160)
    soft = blur(disparity, 2.0)
    assert measure_edge_blur(photo, soft) > 0
    for other in (np.full_like(photo, 0.5), smooth_texture(160, 160)):
        assert measure_edge_blur(other, soft) == 0


def test_the_range_leaves_out_a_few_at_both_ends() -> None:
    values = np.linspace(-2, 3, 10_000, dtype=np.float32).reshape(100, 100)
    values[0, :5], values[1, :5] = 1e6, -1e6
    assert extent(values) == pytest.approx(0.96 * 5, rel=0.01)
    assert extent(np.zeros((0, 4), np.float32)) == 0
