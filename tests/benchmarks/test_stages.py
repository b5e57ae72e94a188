"""The table of stages: everything that is left out changes the views it should, and figures judge what they say."""

from __future__ import annotations

from pkgutil import resolve_name

import numpy as np
import pytest

from benchmarks.stages import STAGES, _judge, _make, _worse
from iibr_core.types import FloatImage, ViewOffset
from tests.iibr_core.scenes import square_before_wall

TRUTH: dict[ViewOffset, FloatImage] = {ViewOffset(2, 2): np.zeros((60, 80, 3), np.float32)}


@pytest.mark.parametrize("name", [name for left in STAGES.values() for name in left])
def test_what_is_put_aside_is_there(name: str) -> None:
    place, _, attribute = name.rpartition(".")
    assert hasattr(resolve_name(f"iibr_core.{place}"), attribute)


@pytest.mark.parametrize("stage", ["smooth gaps", "patches in gaps"])
def test_a_stage_that_is_left_out_changes_the_views(stage: str) -> None:
    photo, disparity = square_before_wall(60, 80)
    whole, without = (
        _make(photo.pixels, disparity.values, None, TRUTH, list(TRUTH), left_out) for left_out in ("nothing", stage)
    )
    assert any((whole[at] != without[at]).any() for at in TRUTH)


def test_figures_see_what_is_wrong_where_it_is() -> None:
    truth = np.full((60, 80, 3), 0.5, np.float32)
    hole = np.zeros((60, 80), np.bool_)
    hole[20:40, 30:40] = True
    made = truth.copy()
    made[20:40, 30:40] = 0.6
    whole, edges, gaps, flying, _ = _judge(made, truth, hole)
    assert edges == 100
    assert gaps == pytest.approx(20, abs=0.01)
    assert gaps < whole < edges
    assert flying == 0
    made[25, 45] = 1.0
    assert _judge(made, truth, hole)[3] > 0


def test_worse_maps_are_worse_and_finite() -> None:
    exact = square_before_wall(60, 80)[1].values
    for seed in range(6):
        for values in _worse(exact, seed).values():
            assert values.shape == exact.shape
            assert values.dtype == np.float32
            assert np.isfinite(values).all()
            assert (values != exact).any()
