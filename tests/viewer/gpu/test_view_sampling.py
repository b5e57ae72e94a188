"""Which views take part: weights sum to one, change smoothly, and a stored view's place is its own."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iibr_core.types import GridShape, ViewOffset
from viewer.gpu.refocus import view_sampling
from viewer.gpu.refocus.view_sampling import answered_samples, pinhole_sources

GRID = GridShape(5, 5)
FULL = np.ones(GRID, bool)
places = st.builds(ViewOffset, st.floats(-6, 6), st.floats(-6, 6))


def some_views(seed):
    present = np.random.default_rng(seed).random(GRID) < 0.3
    present[2, 2] = True
    return present


def weights_by_view(sources):
    weights = np.zeros(GRID)
    for source in sources:
        weights[source.row, source.column] += source.weight
    return weights


def shares_of_views(samples):
    shares = np.zeros(GRID)
    np.add.at(shares, tuple(samples.views.T), samples.weights / samples.weights.sum())
    return shares


def spread_points(count, radius):
    return np.random.default_rng(1).uniform(-radius, radius, (count, 2))


@given(eye=places, seed=st.integers(0, 50))
def test_pinhole_weights_sum_to_one_over_present_views(eye, seed):
    present = some_views(seed)
    sources = pinhole_sources(eye, GRID, present)
    assert sum(source.weight for source in sources) == pytest.approx(1, abs=1e-4)
    assert len(sources) <= 4
    assert all(present[source.row, source.column] and source.weight > 0 for source in sources)
    assert view_sampling.pinhole_samples(sources[:2]).weights.sum() == pytest.approx(1)


@given(eye=st.builds(ViewOffset, st.floats(-2, 2), st.floats(-2, 2)))
def test_pinhole_weights_are_continuous_in_the_eye(eye):
    present = np.zeros(GRID, bool)  # so sparse that no cell is complete: the rule is one and the same
    present[[0, 0, 2, 4, 4, 2], [0, 4, 2, 0, 4, 0]] = True
    here = weights_by_view(pinhole_sources(eye, GRID, present))
    beside = weights_by_view(pinhole_sources(ViewOffset(eye.t + 1e-4, eye.s - 1e-4), GRID, present))
    assert np.abs(here - beside).max() < 0.01


def test_a_stored_view_alone_shows_its_own_place():
    present = some_views(3)
    for row, column in np.argwhere(present):
        weights = weights_by_view(pinhole_sources(GRID.offset(int(row), int(column)), GRID, present))
        assert weights[row, column] == pytest.approx(1, abs=1e-4)


@pytest.mark.parametrize("eye", [ViewOffset(0.25, -0.5), ViewOffset(-1.9, 1.2), ViewOffset(3.0, 0.1)])
def test_cameras_together_blend_views_as_a_pinhole_does(eye):
    """And in passes as at once: each goes on in the sequence."""
    samples = answered_samples(np.zeros((600, 2)), 0, eye, GRID, FULL)
    assert shares_of_views(samples) == pytest.approx(weights_by_view(pinhole_sources(eye, GRID, FULL)), abs=0.01)
    later = answered_samples(np.zeros((20, 2)), 100, eye, GRID, FULL)
    assert np.array_equal(later.views, samples.views[100:120])


def test_blended_views_weigh_what_the_points_ask_of_them():
    points = spread_points(300, 0.8)
    eye = ViewOffset(0.25, -0.5)
    expected = np.mean(
        [weights_by_view(pinhole_sources(ViewOffset(*(point + eye)), GRID, FULL)) for point in points], axis=0
    )
    assert shares_of_views(view_sampling.blended_samples(points, eye, GRID, FULL)) == pytest.approx(expected, abs=1e-3)


def test_nearest_present_against_a_plain_search():
    present = some_views(7)
    for (row, column), answer in zip(np.ndindex(*GRID), view_sampling.nearest_present(present).reshape(-1, 2)):
        least = min(np.hypot(row - r, column - c) for r, c in np.argwhere(present))
        assert np.hypot(row - answer[0], column - answer[1]) == least
        assert present[tuple(answer)]
