"""Steps for blurred edges, pixel by pixel, on known profiles."""

from math import erf, sqrt

import numpy as np
import pytest

from iibr_core.depth.edges import refine
from iibr_core.depth.edges.line import passes

Y, X = np.mgrid[:21, :61].astype(np.float32)


def blurred_step(at, sigma, height=2.0, slope=0.0):
    """From 1 to 1 + height across a column, on a slant, blurred by a Gaussian."""
    share = np.array([0.5 * (1 + erf((x - at) / (sqrt(2) * sigma))) for x in range(61)])
    return np.tile(1 + height * share + slope * np.arange(61), (21, 1)).astype(np.float32)


@pytest.mark.parametrize("sigma", [1.5, 3.0])
@pytest.mark.parametrize("at", [30.0, 30.25, 30.5, 30.75])
@pytest.mark.parametrize("turned", [False, True])
def test_a_blurred_step_becomes_the_step_it_was(sigma, at, turned):
    values, across = blurred_step(at, sigma), 1.0
    if turned:
        values, across, at = np.ascontiguousarray(values[:, ::-1]), -1.0, 60 - at
    for x in range(round(at - 2 * sigma), round(at + 2 * sigma) + 1):
        found = refine._step_value(values, x, 10, across, 0.0, sigma, 0.2)
        if abs(x - at) > 0.3:
            assert found == pytest.approx(3.0 if (x - at) * across > 0 else 1.0, abs=0.06)


def test_what_is_lower_than_an_edge_or_rises_like_a_slant_stays():
    low, slant = blurred_step(30.0, 2.0, height=0.19), blurred_step(30.0, 2.0, height=0.0, slope=0.2)
    for values in (low, slant):
        assert refine._step_value(values, 31, 10, 1.0, 0.0, 2.0, 0.2) == values[10, 31]
    # Three times as wide as this blur makes a step.
    wide = blurred_step(30.0, 6.0)
    assert refine._step_value(wide, 31, 10, 1.0, 0.0, 2.0, 0.2) == wide[10, 31]


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
        assert refine._step_value(twice, x, 10, 1.0, 0.0, 2.0, 0.2) == twice[10, x]
