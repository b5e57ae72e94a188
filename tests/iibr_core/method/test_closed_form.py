import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iibr_core.method.candidates import Candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.occlusion import entropy
from iibr_core.types import ViewOffset


def one_ray(pairs, slots=5):
    """Candidates of a single target ray from (coverage, disparity) pairs."""
    shape = (slots, 1, 1)
    coverage, disparity = np.zeros(shape, np.float32), np.zeros(shape, np.float32)
    for k, (c, d) in enumerate(pairs):
        coverage[k], disparity[k] = c, d
    return Candidates(
        ViewOffset(0.0, 1.0),
        0,
        np.full((1, 1), len(pairs), np.uint8),
        coverage,
        disparity,
        np.zeros(shape, np.uint8),
        np.zeros((1, 1), np.bool_),
    )


def weights_slowly(pairs):
    """Front to back, each surface takes what is left of the pixel."""
    left, weights = 1.0, [0.0] * len(pairs)
    for k in sorted(range(len(pairs)), key=lambda k: (-pairs[k][1], k)):
        weights[k] = min(pairs[k][0], left)
        left -= weights[k]
    return weights


pairs_of_floats = st.lists(
    st.tuples(st.floats(2**-10, 3, width=32), st.floats(-100, 100, width=32)), min_size=1, max_size=5
)


@given(pairs_of_floats)
def test_weights_agree_with_a_slow_twin(pairs):
    weights = closed_form(one_ray(pairs))[:, 0, 0]
    assert weights[: len(pairs)] == pytest.approx(weights_slowly(pairs), abs=1e-5)
    assert weights.min() >= 0
    assert weights.sum() <= 1 + 1e-5


def test_the_front_surface_wins_and_coverage_blends():
    assert closed_form(one_ray([(1.0, 0.0), (1.0, 5.0)]))[:2, 0, 0] == pytest.approx([0, 1])
    assert closed_form(one_ray([(1.0, 0.0), (0.3, 5.0)]))[:2, 0, 0] == pytest.approx([0.7, 0.3])


@given(pairs_of_floats)
def test_the_covered_share_is_what_the_weights_sum_to(pairs):
    weights, covered = closed_form(one_ray(pairs))
    assert covered[0, 0] == pytest.approx(min(weights.sum(), 1), abs=1e-5)


def test_no_candidates_have_no_weight():
    weights, covered = closed_form(one_ray([]))
    assert weights.sum() == covered.sum() == 0


@given(pairs_of_floats)
def test_entropy_is_normalised(pairs):
    value = entropy(closed_form(one_ray(pairs)))[0, 0]
    assert 0 <= value <= 1


@pytest.mark.parametrize("slots", [1, 2, 5, 9])
def test_entropy_of_one_hot_uniform_and_nothing(slots):
    one_hot = np.zeros((slots, 1, 1), np.float32)
    one_hot[0] = 1
    assert entropy(one_hot)[0, 0] == pytest.approx(0, abs=1e-6)
    assert entropy(np.zeros((slots, 1, 1), np.float32))[0, 0] == pytest.approx(1, abs=1e-6)
    if slots > 1:
        assert entropy(np.full((slots, 1, 1), 1 / slots, np.float32))[0, 0] == pytest.approx(1, abs=1e-5)
