"""Pieces of what gives wires their height back: crest, feet, shares of the photo, and the fit, on known profiles."""

from math import erf, sqrt

import numpy as np
import pytest
from iibr_core.depth.edges.edge_profiles import SAMPLES_A_PX, SHARES

from iibr_core.depth.edges import edge_profiles

WALL, WIRE = np.float32([0.2, 0.3, 0.6]), np.float32([0.8, 0.4, 0.1])


def ridge(at, width, sigma, height=2.0, slope=0.0):
    """A wire of a width before a wall that is slanted, blurred by a Gaussian; and its photo."""
    x = np.arange(81)
    ends = [(x - at + side * width / 2) / (sqrt(2) * sigma) for side in (1, -1)]
    share = 0.5 * np.array([erf(a) - erf(b) for a, b in zip(*ends)])
    covered = np.clip(width / 2 + 0.5 - abs(x - at), 0, 1)[:, None]
    photo = np.tile(covered * WIRE + (1 - covered) * WALL, (9, 1, 1)).astype(np.float32)
    return np.tile(1 + slope * (x - at) + height * share, (9, 1)).astype(np.float32), photo


def test_colours_between_pixels_are_bilinear_and_the_border_goes_on():
    photo = np.random.default_rng(0).random((4, 5, 3)).astype(np.float32)
    found = edge_profiles._color_at(photo, 2.25, 1.5)
    expected = 0.75 * photo[1:3, 2].mean(axis=0) + 0.25 * photo[1:3, 3].mean(axis=0)
    np.testing.assert_allclose(found, expected, rtol=1e-5)
    np.testing.assert_allclose(edge_profiles._color_at(photo, 9.0, -3.0), photo[0, 4])
    np.testing.assert_allclose(edge_profiles._color_at(photo, -1.0, 9.0), photo[3, 0])
    assert edge_profiles._product((1.0, 2.0, 3.0), (0.5, 1.0, 4.0), (1.0, 1.0, 1.0)) == 6


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("away", [-2.0, -0.5, 0.0, 1.5])
def test_the_crest_is_the_highest_place_near_by(sign, away):
    values = sign * ridge(40.0, 3, 1.5)[0]
    assert edge_profiles._crest(values, 40.0 - away, 4.0, 1.0, 0.0, sign) == pytest.approx(away)
    # Of two pixels as high as each other it lies between.
    assert edge_profiles._crest(sign * ridge(40.5, 4, 1.5)[0], 41.0, 4.0, 1.0, 0.0, sign) == pytest.approx(-0.5)


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_feet_lie_where_a_ridge_has_ended_on_both_sides_and_steps_have_none(sign):
    values = sign * ridge(40.0, 3, 1.5)[0]
    before, after = edge_profiles._feet(values, 40.0, 4.0, 1.0, 0.0, sign, 20, 0.3)
    assert before == after
    assert 4 <= before <= 8
    assert edge_profiles._feet(values, 40.0, 4.0, 1.0, 0.0, sign, 20, 2.0) == (0, 0), "lower than that"
    assert edge_profiles._feet(values, 40.0, 4.0, 1.0, 0.0, -sign, 20, 0.3) == (0, 0), "the other way round"
    uneven = values.copy()
    uneven[:, 41:] = np.maximum(uneven[:, 41:], 2.1) if sign > 0 else np.minimum(uneven[:, 41:], -2.1)
    assert edge_profiles._feet(uneven, 40.0, 4.0, 1.0, 0.0, sign, 20, 0.3) == (0, 0), "one side much higher"


def test_shares_are_the_photo_s():
    _, photo = ridge(40.0, 4, 1.5)
    shares = np.empty(SHARES)
    first, last = edge_profiles._structure_shares(photo, 40.0, 4.0, 1.0, 0.0, (8.0, 8.0), 20.0, shares)
    assert (last - first) / SAMPLES_A_PX == pytest.approx(4, abs=1)
    assert shares.sum() / SAMPLES_A_PX == pytest.approx(4, abs=0.6)
    assert shares[SHARES // 2] == 1
    assert not shares[:first].any()
    assert not shares[last + 1 :].any()
    assert np.allclose(shares, shares[::-1], atol=1e-5)
    for widest, of_photo in ((2.0, photo), (20.0, np.full_like(photo, 0.5))):
        first, last = edge_profiles._structure_shares(of_photo, 40.0, 4.0, 1.0, 0.0, (8.0, 8.0), widest, shares)
        assert last < first


@pytest.mark.parametrize("sigma", [1.0, 2.0])
@pytest.mark.parametrize("slope", [0.0, 0.03])
@pytest.mark.parametrize("height", [2.0, -1.5])
def test_a_fit_finds_height_ground_and_slope(sigma, slope, height):
    values, _ = ridge(40.0, 4, sigma, height, slope)
    shares = np.zeros(SHARES)
    middle = SHARES // 2
    shares[middle - 4 : middle + 5] = [0.5, *[1] * 7, 0.5]
    taps = np.empty(SHARES)
    fit = edge_profiles._fit_structure(values, 40.0, 4.0, 1.0, 0.0, shares, middle - 4, middle + 4, sigma, taps)
    assert fit[:3] == (pytest.approx(height, rel=0.02), pytest.approx(1, abs=0.05), pytest.approx(slope, abs=2e-3))
    assert fit[3] < 0.02
    # Another blur leaves a misfit.
    assert (
        edge_profiles._fit_structure(values, 40.0, 4.0, 1.0, 0.0, shares, middle - 4, middle + 4, 2 * sigma, taps)[3]
        > 0.02
    )


@pytest.mark.parametrize("sign", [1.0, -1.0])
@pytest.mark.parametrize("x", [36, 39, 40, 41, 44])
def test_a_pixel_of_a_structure_gets_its_height_and_its_share(sign, x):
    values, photo = ridge(40.0, 4, 1.5, 2.0 * sign, 0.02)
    shares, taps = np.empty(SHARES), np.empty(SHARES)
    found = edge_profiles.structure_at(values, photo, x, 4, 1.0, 0.0, 40.0 - x, sign, 1.5, 0.3, shares, taps)
    height, ground, share = found
    assert height == pytest.approx(2.0 * sign, rel=0.1)
    assert ground == pytest.approx(1 + 0.02 * (x - 40), abs=0.08)
    assert share == (1 if abs(x - 40) < 2 else 0)
    assert edge_profiles.structure_at(values, photo, x, 4, 1.0, 0.0, 40.0 - x, -sign, 1.5, 0.3, shares, taps)[0] == 0


@pytest.mark.parametrize("sigma", [1.0, 1.5, 2.5])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_structure_tells_the_blur(sigma, sign):
    values, photo = ridge(40.0, 4, sigma, 2.0 * sign)
    shares, taps = np.empty(SHARES), np.empty(SHARES)
    found, height = edge_profiles.structure_blur(values, photo, 40.0, 4.0, 1.0, 0.0, sign, 0.2, shares, taps)
    assert found == pytest.approx(sigma, rel=0.15)
    assert height == pytest.approx(2.0, rel=0.1)
