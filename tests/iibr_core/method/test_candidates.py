import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as stn

from iibr_core.method.candidates import SLOTS, find_candidates
from iibr_core.method.occlusion import entropy
from iibr_core.types import ViewOffset
from tests.iibr_core.method.ray_sets import ray_set


def used(candidates, values):
    slots = np.arange(values.shape[0])[:, None, None]
    return np.where(slots < candidates.number, values, 0)


def test_a_narrow_gap_shows_the_farther_of_both_surfaces_and_nothing_behind_them():
    surfaces = np.tile(np.where(np.arange(12) < 5, 2.0, 1.0), (6, 1))
    closed, opened = (find_candidates(ray_set(surfaces, farthest=3.0), ViewOffset(0, s), (0, 6)) for s in (1.0, 2.0))
    # The nearer one's last ray lands at 4 - 2 s, the other's first at 5 - s.
    assert used(closed, closed.coverage).sum(axis=0)[:, :7] == pytest.approx(1, abs=1e-5)
    assert (closed.disparity[0, :, 3] == 1.0).all()
    assert (opened.number[:, 1:3] == 0).all()


def test_behind_what_the_photo_shows_and_covers_nothing_else_lands():
    foreground, background = np.full((6, 10), 2.0), np.full((6, 10), 0.25)
    found = find_candidates(ray_set(foreground, background, farthest=3.0), ViewOffset(0.0, 1.0), (0, 6))
    assert (found.source[0, :, :7] == 0).all()
    assert (found.number[:, :7] == 1).all()
    assert (found.source[0, :, 8] == 1).all(), "the foreground has moved away"


def test_the_rearmost_gives_way_where_slots_run_out():
    layers = [np.full((3, 12), float(d)) for d in range(SLOTS + 2)]
    found = find_candidates(ray_set(*layers, farthest=3.0), ViewOffset(0.0, 1.0), (0, 3))
    assert sorted(found.disparity[:, 1, 4]) == [*range(2, SLOTS + 2)]


def test_bands_do_not_change_what_is_found():
    disparity = (np.arange(20)[:, None] * -0.4 + np.random.default_rng(1).uniform(-2, 2, (20, 15))).astype(np.float32)
    rays, offset = ray_set(disparity, farthest=3.0), ViewOffset(1.7, -0.4)
    whole = find_candidates(rays, offset, (0, 20))
    for first, last in ((0, 7), (7, 20), *((row, row + 1) for row in range(20))):
        band = find_candidates(rays, offset, (first, last))
        assert (band.number == whole.number[first:last]).all()
        assert (used(band, band.coverage) == used(whole, whole.coverage)[:, first:last]).all()
        assert (used(band, band.disparity) == used(whole, whole.disparity)[:, first:last]).all()


def entropy_in_doubles(weights):
    weights = weights.astype(np.float64)
    shares = weights + (1 - np.minimum(weights.sum(axis=0), 1)) / len(weights)
    return -np.where(shares > 0, shares * np.log(np.maximum(shares, 1e-300)), 0).sum(axis=0) / np.log(len(weights))


@given(stn.arrays(np.float32, st.tuples(st.integers(2, 9), st.just(2), st.just(3)), elements=st.floats(0, 1, width=32)))
def test_entropy_is_from_0_to_1_and_that_of_doubles(weights):
    """Also of denormal weights, and of sums that rounding carries beyond one."""
    weights = weights / np.maximum(weights.sum(axis=0, dtype=np.float64), 1).astype(np.float32)
    assert np.abs(entropy(weights) - entropy_in_doubles(weights)).max() <= 1e-6
    for factor in (1 + 1e-6, 1e-42):
        values = entropy(weights * np.float32(factor))
        assert (values >= 0).all()
        assert (values <= 1).all()
