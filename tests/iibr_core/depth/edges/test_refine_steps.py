"""One pixel's way from a blurred edge to a step, piece by piece, on profiles that are known."""

from math import erf, erfc, sqrt

import numpy as np
import pytest
from iibr_core.depth.edges.edge_profiles import passes

from iibr_core.depth.edges import refine

Y, X = np.mgrid[:21, :61].astype(np.float32)
GREY = np.full((21, 61, 3), 0.5, np.float32)


def blurred_step(at, sigma, height=2.0, slope=0.0):
    """From 1 to 1 + height across a column, on a slant, blurred by a Gaussian."""
    share = np.array([0.5 * (1 + erf((x - at) / (sqrt(2) * sigma))) for x in range(61)])
    return np.tile(1 + height * share + slope * np.arange(61), (21, 1)).astype(np.float32)


def test_a_surface_goes_on_by_a_share_of_its_slope_up_to_a_limit():
    plane = 1 + 0.02 * X
    for values, limit, slope in ((plane, 1.0, 0.02), (plane, 0.01, 0.01), (-plane, 0.01, -0.01)):
        for share in (refine.EXTENSION, refine.BEND):
            found = refine._continued(values, 30, 10, 1.0, 0.0, 6.0, 2.0, share, limit)
            assert found == pytest.approx(values[10, 36] - share * 6 * slope, abs=1e-5)


@pytest.mark.parametrize("sigma", [1.0, 3.0])
def test_a_tail_is_what_a_gaussian_leaves_there(sigma):
    assert refine._tail(2 * sigma, sigma) == pytest.approx(0.5 * erfc(sqrt(2)))
    assert refine._tail(0.0, sigma) == 0.5


@pytest.mark.parametrize("apart", [1, 2])
@pytest.mark.parametrize("form", [(0.03, 0.01, 0.0), (-0.01, -0.05, 0.02), (0.0, 0.02, 0.03), (0.02, -0.04, -0.01)])
def test_curvature_is_the_larger_eigenvalue_of_the_second_derivatives(form, apart):
    xx, yy, xy = form
    values = (0.5 * xx * (X - 30) ** 2 + 0.5 * yy * (Y - 10) ** 2 + xy * (X - 30) * (Y - 10) + 0.1 * X).astype(
        np.float32
    )
    bend, across, down = refine._curvature(values, 30, 10, apart)
    sizes, ways = np.linalg.eigh([[xx, xy], [xy, yy]])
    mean = xx + yy
    expected = np.argmax(sizes) if mean >= 0 else np.argmin(sizes)
    assert bend == pytest.approx(sizes[expected], abs=1e-5)
    assert abs(np.dot(ways[:, expected], (across, down))) == pytest.approx(1, abs=1e-3)
    assert refine._curvature(np.zeros((21, 61), np.float32), 30, 10, apart) == (0.0, 1.0, 0.0)


@pytest.mark.parametrize("sigma", [1.5, 3.0])
@pytest.mark.parametrize("at", [30.0, 30.25, 30.5, 30.75])
@pytest.mark.parametrize("turned", [False, True])
def test_a_blurred_step_becomes_the_step_it_was(sigma, at, turned):
    values, across = blurred_step(at, sigma), 1.0
    if turned:
        values, across, at = np.ascontiguousarray(values[:, ::-1]), -1.0, 60 - at
    for x in range(round(at - 2 * sigma), round(at + 2 * sigma) + 1):
        found = refine._as_step(values, x, 10, across, 0.0, sigma, 0.2)
        if abs(x - at) > 0.3:
            assert found == pytest.approx(3.0 if (x - at) * across > 0 else 1.0, abs=0.06)


def test_what_is_lower_than_an_edge_or_rises_like_a_slant_stays():
    low, slant = blurred_step(30.0, 2.0, height=0.19), blurred_step(30.0, 2.0, height=0.0, slope=0.2)
    for values in (low, slant):
        assert refine._as_step(values, 31, 10, 1.0, 0.0, 2.0, 0.2) == values[10, 31]
    # Three times as wide as this blur makes a step.
    wide = blurred_step(30.0, 6.0)
    assert refine._as_step(wide, 31, 10, 1.0, 0.0, 2.0, 0.2) == wide[10, 31]


@pytest.mark.parametrize("turned", [False, True])
def test_what_comes_back_on_both_sides_is_a_relief_and_on_one_side_no_tail_is_added(turned):
    """A step of blur 2 px is looked at up to 12 px from its middle."""
    step = blurred_step(30.0, 2.0) - 1
    step = step[:, ::-1] if turned else step
    across = -1.0 if turned else 1.0
    once = np.ascontiguousarray(step * (1 - (np.roll(step, across * 10, axis=1) / 2)) + 1).astype(np.float32)
    assert passes(once, 30, 10, across, 0.0, 4.0, 12.0, -1.0, 2.0)
    assert not passes(once, 30, 10, across, 0.0, 4.0, 8.0, -1.0, 2.0)
    assert not passes(once, 30, 10, -across, 0.0, 4.0, 12.0, 1.0, 2.0)
    assert passes(once, 30, 10, -across, 0.0, 4.0, 31.0, 1.0, 2.0), "outside"
    twice = 2 + np.sin((X - 30) * np.pi / 8)
    for x in range(27, 34):
        assert refine._as_step(twice, x, 10, 1.0, 0.0, 2.0, 0.2) == twice[10, x]
