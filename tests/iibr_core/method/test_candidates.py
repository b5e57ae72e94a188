import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as stn

from iibr_core.method.candidates import CLOSED_GAP_PX, SEALED_GAP_PX, SLOTS, Candidates, find_candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.occlusion import entropy
from iibr_core.surfaces import SAME_SURFACE_PX
from iibr_core.types import ViewOffset
from tests.iibr_core.method.ray_sets import ray_set


def footprints_slowly(disparity, offset):
    """Yield every ray's landed rectangle: to its neighbours' midpoints where they are close, right to a nearer one
    that is farther off, else one pixel wide.
    """

    def reach(neighbour, d, shift):
        gap = (neighbour - d) * shift
        if abs(gap) <= SEALED_GAP_PX:
            return (1 + gap) / 2
        return 0.5 + gap if neighbour > d and 0 < gap <= CLOSED_GAP_PX else 0.5

    height, width = disparity.shape
    t, s = offset
    for y in range(height):
        for x in range(width):
            d = float(disparity[y, x])
            left = reach(disparity[y, x - 1], d, s) if x > 0 else 0.5
            right = reach(disparity[y, x + 1], d, -s) if x + 1 < width else 0.5
            top = reach(disparity[y - 1, x], d, t) if y > 0 else 0.5
            bottom = reach(disparity[y + 1, x], d, -t) if y + 1 < height else 0.5
            yield d, x - d * s - left, x - d * s + right, y - d * t - top, y - d * t + bottom


def total_coverage_slowly(disparity, offset):
    height, width = disparity.shape
    total = np.zeros((height, width))
    for _, left, right, top, bottom in footprints_slowly(disparity, offset):
        for y in range(height):
            for x in range(width):
                overlap_x = min(right, x + 0.5) - max(left, x - 0.5)
                overlap_y = min(bottom, y + 0.5) - max(top, y - 0.5)
                if overlap_x > 0 and overlap_y > 0:
                    total[y, x] += overlap_x * overlap_y
    return total


def used(candidates, values):
    slots = np.arange(values.shape[0])[:, None, None]
    return np.where(slots < candidates.number, values, 0)


@pytest.mark.parametrize(
    "offset", [ViewOffset(0.0, 0.0), ViewOffset(0.0, 1.3), ViewOffset(-2.4, 0.7), ViewOffset(3.0, 3.0)]
)
def test_coverage_agrees_with_a_slow_twin(offset):
    disparity = np.random.default_rng(3).uniform(-0.6, 0.6, (9, 11)).astype(np.float32)
    found = find_candidates(ray_set(disparity, farthest=3.0), offset, (0, 9))
    has_room = found.number < SLOTS
    total = used(found, found.coverage).sum(axis=0)
    assert total[has_room] == pytest.approx(total_coverage_slowly(disparity, offset)[has_room], abs=2e-3)
    assert has_room.mean() > 0.9


def test_a_narrow_gap_shows_the_farther_of_both_surfaces_and_nothing_behind_them():
    surfaces = np.tile(np.where(np.arange(12) < 5, 2.0, 1.0), (6, 1))
    closed, opened = (find_candidates(ray_set(surfaces, farthest=3.0), ViewOffset(0, s), (0, 6)) for s in (1.0, 2.0))
    # The nearer one's last ray lands at 4 - 2 s, the other's first at 5 - s.
    assert used(closed, closed.coverage).sum(axis=0)[:, :7] == pytest.approx(1, abs=1e-5)
    assert (closed.disparity[0, :, 3] == 1.0).all()
    assert (opened.number[:, 1:3] == 0).all()


def test_two_surfaces_make_two_candidates_however_many_rays_land():
    foreground, background = np.full((6, 10), 2.0), np.full((6, 10), 0.25)
    found = find_candidates(ray_set(background, foreground, farthest=3.0), ViewOffset(0.0, 1.0), (0, 6))
    assert (found.number[:, :7] == 2).all()
    assert {*found.source[:2, 3, 3]} == {0, 1}


def test_behind_what_the_photo_shows_and_covers_nothing_else_lands():
    foreground, background = np.full((6, 10), 2.0), np.full((6, 10), 0.25)
    found = find_candidates(ray_set(foreground, background, farthest=3.0), ViewOffset(0.0, 1.0), (0, 6))
    assert (found.source[0, :, :7] == 0).all()
    assert (found.number[:, :7] == 1).all()
    assert (found.source[0, :, 8] == 1).all(), "the foreground has moved away"


def test_surfaces_closer_than_the_tolerance_are_one():
    columns = np.arange(8)
    for near in (np.where(columns % 2, 1.0, 1.0 + 0.9 * SAME_SURFACE_PX / 2), np.where(columns < 4, 1.0, 1.0001)):
        found = find_candidates(ray_set(np.tile(near, (4, 1)), farthest=3.0), ViewOffset(0.0, 2.0), (0, 4))
        assert (found.number[:, :5] == 1).all()


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


def test_rays_without_coverage_do_not_land():
    coverage = np.zeros((5, 5), np.float32)
    coverage[2, 2] = 0.25
    found = find_candidates(ray_set(np.zeros((5, 5)), coverage=coverage, farthest=3.0), ViewOffset(0.0, 1.0), (0, 5))
    assert found.number.sum() == 1
    assert found.coverage[0, 2, 2] == pytest.approx(0.25)


def one_ray(pairs):
    """Return the candidates of a single target ray from (coverage, disparity) pairs."""
    shape = (SLOTS, 1, 1)
    coverage, disparity = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    for k, (c, d) in enumerate(pairs):
        coverage[k], disparity[k] = c, d
    number, source = np.full((1, 1), len(pairs), np.uint8), np.zeros(shape, np.uint8)
    return Candidates(ViewOffset(0.0, 1.0), 0, number, coverage, disparity, source, np.zeros((1, 1), np.bool_))


def weights_slowly(pairs):
    """Front to back, each surface takes what is left of the pixel."""
    left, weights = 1.0, [0.0] * len(pairs)
    for k in sorted(range(len(pairs)), key=lambda k: (-pairs[k][1], k)):
        weights[k] = min(pairs[k][0], left)
        left -= weights[k]
    return weights


@given(st.lists(st.tuples(st.floats(2**-10, 3, width=32), st.floats(-100, 100, width=32)), min_size=0, max_size=SLOTS))
def test_weights_and_their_sum_agree_with_a_slow_twin(pairs):
    weights, covered = closed_form(one_ray(pairs))
    assert weights[: len(pairs), 0, 0] == pytest.approx(weights_slowly(pairs), abs=1e-5)
    assert weights.min() >= 0
    assert covered[0, 0] == pytest.approx(min(weights.sum(), 1), abs=1e-5)


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
