"""Which views take part: weights sum to one, change smoothly, and a stored view's place is its own."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iibr_core.scenes.lens_limits import clamp_to_grid
from iibr_core.types import GridShape, ViewOffset
from viewer.gpu.refocus.view_sampling import aperture_samples, nearest_present, pinhole_sources

GRID = GridShape(5, 5)
FULL = np.ones(GRID, bool)
places = st.builds(ViewOffset, st.floats(-6, 6), st.floats(-6, 6))


def some_views(seed: int) -> np.ndarray:
    present = np.random.default_rng(seed).random(GRID) < 0.3
    present[2, 2] = True
    return present


def weights_by_view(sources: list) -> np.ndarray:
    weights = np.zeros(GRID)
    for source in sources:
        weights[source.row, source.column] += source.weight
    return weights


def test_full_field_is_bilinear() -> None:
    weights = weights_by_view(pinhole_sources(ViewOffset(0.25, -0.5), GRID, FULL))
    assert weights[2, 1:3] == pytest.approx([0.375, 0.375])
    assert weights[3, 1:3] == pytest.approx([0.125, 0.125])


@given(eye=places, seed=st.integers(0, 50))
def test_pinhole_weights_sum_to_one_over_present_views(eye: ViewOffset, seed: int) -> None:
    present = some_views(seed)
    sources = pinhole_sources(eye, GRID, present)
    assert sum(source.weight for source in sources) == pytest.approx(1, abs=1e-4)
    assert len(sources) <= 4
    assert all(present[source.row, source.column] and source.weight > 0 for source in sources)


@given(eye=st.builds(ViewOffset, st.floats(-2, 2), st.floats(-2, 2)))
def test_pinhole_weights_are_continuous_in_the_eye(eye: ViewOffset) -> None:
    present = np.zeros(GRID, bool)  # so sparse that no cell is complete: the rule is one and the same
    present[[0, 0, 2, 4, 4, 2], [0, 4, 2, 0, 4, 0]] = True
    here = weights_by_view(pinhole_sources(eye, GRID, present))
    beside = weights_by_view(pinhole_sources(ViewOffset(eye.t + 1e-4, eye.s - 1e-4), GRID, present))
    assert np.abs(here - beside).max() < 0.01


def test_a_stored_view_alone_shows_its_own_place() -> None:
    present = some_views(3)
    for row, column in np.argwhere(present):
        weights = weights_by_view(pinhole_sources(GRID.offset(int(row), int(column)), GRID, present))
        assert weights[row, column] == pytest.approx(1, abs=1e-4)


def test_no_views_no_sources() -> None:
    assert pinhole_sources(ViewOffset(0.0, 0.0), GRID, np.zeros(GRID, bool)) == []


@given(eye=places, diameter=st.floats(1, 20))
def test_aperture_weights_sum_to_one(eye: ViewOffset, diameter: float) -> None:
    samples = aperture_samples(eye, diameter, GRID, FULL)
    assert sum(sample.weight for sample in samples) == pytest.approx(1, abs=1e-3)


def test_aperture_is_a_disc_with_a_soft_edge() -> None:
    """Three kinds of views take part; the blur is as wide as the disc's, which tells how much each counts."""
    weights = weights_by_view(aperture_samples(ViewOffset(0.0, 0.0), 3.0, GRID, FULL))
    middle, side, corner = weights[2, 2], weights[2, 1], weights[1, 1]
    assert middle > side > corner > 0
    assert side / middle - corner / middle == pytest.approx(np.sqrt(2) - 1), "the edge fades over one view step"
    assert weights == pytest.approx(weights.T)
    assert weights == pytest.approx(weights[::-1])
    assert weights[2, 0] == weights[0, 0] == 0
    assert 2 * side + 4 * corner == pytest.approx(1.5**2 / 4, rel=0.01)


def test_missing_views_are_answered_by_the_nearest_present() -> None:
    present = np.zeros(GRID, bool)
    present[2, 2] = present[0, 0] = True
    samples = aperture_samples(ViewOffset(0.0, 0.0), 20.0, GRID, present)
    assert len(samples) == 25
    answers = {sample.wanted: (sample.row, sample.column) for sample in samples}
    assert answers[ViewOffset(-2.0, -1.0)] == (0, 0)
    assert answers[ViewOffset(2.0, 2.0)] == (2, 2)


def test_nearest_present_against_a_plain_search() -> None:
    present = some_views(7)
    for (row, column), answer in zip(np.ndindex(*GRID), nearest_present(present).reshape(-1, 2)):
        least = min(np.hypot(row - r, column - c) for r, c in np.argwhere(present))
        assert np.hypot(row - answer[0], column - answer[1]) == least
        assert present[tuple(answer)]


def test_clamped_to_grid_of_even_and_single_sizes() -> None:
    assert clamp_to_grid(ViewOffset(9.0, -9.0), GridShape(4, 1)) == ViewOffset(1.0, 0.0)
