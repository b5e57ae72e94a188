import numpy as np
import pytest

from iibr_core.depth.edges.blur import measure_edge_blur
from iibr_core.depth.edges.fit import fit_to_blur
from iibr_core.depth.edges.lone import _find_lone, fill_lone
from iibr_core.training.degradation import blur
from tests.iibr_core.depth.edges.test_refine import disc_before_slope
from tests.iibr_core.scenes import smooth_texture

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
