"""Weights of candidates, the covered share and the entropy that follow from them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as stn

from iibr_core.method.candidates import SLOTS, Candidates
from iibr_core.method.closed_form import closed_form
from iibr_core.method.occlusion import entropy
from iibr_core.types import ViewOffset


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
