"""Which views take part: weights sum to one, change smoothly, and a stored view's place is its own."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iibr_core.beyond.aperture_sampling import views_in_aperture
from iibr_core.beyond.optics import ApertureShape
from iibr_core.types import CENTRE, GridShape, ViewOffset
from viewer.gpu.refocus import view_sampling
from viewer.gpu.refocus.view_sampling import pinhole_sources

GRID = GridShape(5, 5)
FULL = np.ones(GRID, bool)


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


@given(eye=st.builds(ViewOffset, st.floats(-2, 2), st.floats(-2, 2)))
def test_pinhole_weights_are_continuous_in_the_eye(eye):
    present = np.zeros(GRID, bool)  # so sparse that no cell is complete: the rule is one and the same
    present[[0, 0, 2, 4, 4, 2], [0, 4, 2, 0, 4, 0]] = True
    here = weights_by_view(pinhole_sources(eye, GRID, present))
    beside = weights_by_view(pinhole_sources(ViewOffset(eye.t + 1e-4, eye.s - 1e-4), GRID, present))
    assert np.abs(here - beside).max() < 0.01


def test_missing_views_are_replaced_by_their_neighbours_in_an_aperture():
    shape, present = ApertureShape(), some_views(7)
    everywhere = shares_of_views(view_sampling.blended_samples(shape, 3.0, CENTRE, GRID, FULL))
    assert everywhere == pytest.approx(views_in_aperture(shape, 3.0, CENTRE, GRID), abs=1e-3)
    shares = shares_of_views(view_sampling.blended_samples(shape, 3.0, CENTRE, GRID, present))
    assert shares.sum() == pytest.approx(1)
    assert (shares[~present] == 0).all()


def test_nearest_present_against_a_plain_search():
    present = some_views(7)
    for (row, column), answer in zip(np.ndindex(*GRID), view_sampling.nearest_present(present).reshape(-1, 2)):
        least = min(np.hypot(row - r, column - c) for r, c in np.argwhere(present))
        assert np.hypot(row - answer[0], column - answer[1]) == least
        assert present[tuple(answer)]
