"""Picking against a slow twin that lets every pixel of the view land."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from iibr_core.types import GridShape, ViewOffset
from viewer.display.picking import LANDING_RADIUS_PX, is_kept_for_picking, pick_disparity

CENTRE = ViewOffset(0.0, 0.0)


def slow_pick(disparity: np.ndarray, step: ViewOffset, x: float, y: float) -> float:
    """Every pixel lands; the front-most within the radius wins, else the closest."""
    landings = []
    for row in range(disparity.shape[0]):
        for column in range(disparity.shape[1]):
            d = float(disparity[row, column])
            landings.append((math.hypot(column - d * step.s - x, row - d * step.t - y), d))
    under = [d for distance, d in landings if distance <= LANDING_RADIUS_PX]
    return max(under) if under else min(landings)[1]


@given(
    seed=st.integers(0, 99),
    t=st.floats(-3, 3),
    s=st.floats(-3, 3),
    x=st.floats(0, 15),
    y=st.floats(0, 11),
)
def test_picks_what_the_slow_twin_picks(seed: int, t: float, s: float, x: float, y: float) -> None:
    disparity = np.random.default_rng(seed).uniform(-2, 2, (12, 16)).astype(np.float32)
    picked = pick_disparity({CENTRE: disparity}, ViewOffset(t, s), x, y)
    expected = slow_pick(disparity, ViewOffset(t, s), x, y)
    step_is_over_the_edge = slow_distance(disparity, ViewOffset(t, s), x, y) > 1
    if not step_is_over_the_edge:  # far outside, the twin looks at pixels that cannot be under the pointer
        assert picked == pytest.approx(expected)


def slow_distance(disparity: np.ndarray, step: ViewOffset, x: float, y: float) -> float:
    rows, columns = np.mgrid[: disparity.shape[0], : disparity.shape[1]]
    return float(np.hypot(columns - disparity * step.s - x, rows - disparity * step.t - y).min())


def test_the_nearer_of_two_surfaces_wins_where_they_overlap() -> None:
    disparity = np.zeros((9, 21), np.float32)
    disparity[:, 12:] = 4.0  # in view s = 1 its left border moves from 12 to 8
    assert pick_disparity({CENTRE: disparity}, ViewOffset(0, 1), 9, 4) == 4.0
    assert pick_disparity({CENTRE: disparity}, ViewOffset(0, 1), 6, 4) == 0.0
    assert pick_disparity({CENTRE: disparity}, CENTRE, 9, 4) == 0.0


def test_a_one_pixel_wire_is_hit() -> None:
    disparity = np.zeros((9, 21), np.float32)
    disparity[:, 10] = 2.0
    assert pick_disparity({CENTRE: disparity}, ViewOffset(0, 0.5), 9, 4) == 2.0


def test_the_map_nearest_to_the_eye_is_asked() -> None:
    maps = {CENTRE: np.zeros((4, 4), np.float32), ViewOffset(0, 4): np.full((4, 4), 0.25, np.float32)}
    assert pick_disparity(maps, ViewOffset(0, 1.9), 2, 2) == 0.0
    assert pick_disparity(maps, ViewOffset(0, 2.1), 2, 2) == 0.25


@pytest.mark.parametrize(("x", "y"), [(-50, -50), (1e6, 3), (2, 2)])
def test_an_outlier_and_a_pointer_outside_give_a_value_of_the_map(x: float, y: float) -> None:
    disparity = np.zeros((5, 5), np.float32)
    disparity[0, 0] = 1e6
    assert pick_disparity({CENTRE: disparity}, ViewOffset(2, -3), x, y) in (0.0, 1e6)


def test_at_most_nine_maps_are_kept_the_centre_among_them() -> None:
    for grid in (GridShape(9, 9), GridShape(8, 17), GridShape(1, 1), GridShape(2, 3)):
        kept = [(r, c) for r in range(grid.rows) for c in range(grid.columns) if is_kept_for_picking(grid, r, c)]
        assert grid.centre in kept
        assert len(kept) <= 9
