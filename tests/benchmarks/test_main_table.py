"""The main table: an estimate brought to the median of the truth, as SHARP's table does."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.tables.main_table import median_scaled


def test_only_a_scale_is_taken_from_the_truth() -> None:
    rng = np.random.default_rng(0)
    truth = rng.uniform(5, 60, (20, 30)).astype(np.float32)
    estimate = rng.uniform(-1, 1, truth.shape).astype(np.float32)
    found = median_scaled(estimate, truth)
    assert np.median(found) == pytest.approx(np.median(truth), rel=1e-6)
    assert found.min() == 0
    np.testing.assert_allclose(median_scaled(3 * estimate + 7, truth), found, rtol=1e-4, atol=1e-4)


def test_what_is_not_known_of_the_truth_does_not_count() -> None:
    truth = np.array([[10, np.nan, 30, 50]], np.float32)
    assert np.median(median_scaled(np.array([[0, 1, 2, 3]], np.float32), truth)) == 30


def test_a_flat_estimate_has_no_scale() -> None:
    assert not median_scaled(np.full((2, 3), 4, np.float32), np.ones((2, 3), np.float32)).any()
