"""The table of stages: figures judge what they say, and decide which stage stays."""

from __future__ import annotations

import numpy as np
import pytest

from benchmarks.stages import _worse, earns, judge_view
from tests.iibr_core.scenes import square_before_wall


@pytest.mark.parametrize(
    ("changes", "stays"),
    [
        ([(-0.05, 0.0), (0.05, 0.3)], True),
        ([(0.0, -0.1), (0.0, 0.0)], True),
        ([(-0.04, -0.09), (0.0, 0.0)], False),
        ([(-0.8, -0.9), (0.06, 0.0)], False),
    ],
)
def test_a_stage_stays_that_gains_somewhere_and_loses_nowhere(changes: list[tuple[float, float]], stays: bool) -> None:
    assert earns(map(np.array, changes)) == stays


def test_figures_see_what_is_wrong_where_it_is() -> None:
    truth = np.full((60, 80, 3), 0.5, np.float32)
    hole = np.zeros((60, 80), np.bool_)
    hole[20:40, 30:40] = True
    made = truth.copy()
    made[20:40, 30:40] = 0.6
    whole, edges, gaps, flying, _ = judge_view(made, truth, hole)
    assert edges == 100
    assert gaps == pytest.approx(20, abs=0.01)
    assert gaps < whole < edges
    assert flying == 0
    made[25, 45] = 1.0
    assert judge_view(made, truth, hole)[3] > 0


def test_worse_maps_are_worse_and_finite() -> None:
    exact = square_before_wall(60, 80)[1].values
    for seed in range(6):
        for values in _worse(exact, seed).values():
            assert values.shape == exact.shape
            assert values.dtype == np.float32
            assert np.isfinite(values).all()
            assert (values != exact).any()
