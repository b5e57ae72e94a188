"""From estimates of three kinds to disparity: ranges, true scale, and values that are missing or wild."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from iibr_core.depth.estimate import OUTLIER_SPANS, DepthEstimate, Meaning, disparity_from, inverse_metres_over
from iibr_core.types import TOTAL_PARALLAX, GridShape, InputError

GRID = GridShape(9, 9)


def ramp(height: int = 40, width: int = 50) -> np.ndarray:
    return np.linspace(0, 1, height * width, dtype=np.float32).reshape(height, width)


@pytest.mark.parametrize(("scale", "offset"), [(1.0, 0.0), (1e-6, 3e-6), (1e6, -1e5), (500.0, 17.0)])
def test_scale_and_offset_of_relative_depth_do_not_matter(scale: float, offset: float) -> None:
    expected = disparity_from(DepthEstimate(ramp(), "inverse depth"), GRID)
    got = disparity_from(DepthEstimate((ramp() * scale + offset).astype(np.float32), "inverse depth"), GRID)
    np.testing.assert_allclose(got, expected, atol=1e-4)


@pytest.mark.parametrize("grid", [GridShape(9, 9), GridShape(1, 5), GridShape(3, 1), GridShape(17, 17)])
def test_the_range_suits_the_grid(grid: GridShape) -> None:
    disparity = disparity_from(DepthEstimate(ramp(), "inverse depth"), grid)
    low, high = np.percentile(disparity, [1, 99])
    assert (high - low) * (max(grid) - 1) == pytest.approx(TOTAL_PARALLAX * 50, rel=1e-4)
    assert np.median(disparity) == pytest.approx(0, abs=1e-5)


def test_a_grid_of_one_view_is_no_division_by_zero() -> None:
    assert np.isfinite(disparity_from(DepthEstimate(ramp(), "inverse depth"), GridShape(1, 1))).all()


def test_metric_depth_is_spread_by_inverse_depth() -> None:
    inverse = ramp() + 0.5
    got = disparity_from(DepthEstimate(1 / inverse, "metres"), GRID)
    np.testing.assert_allclose(got, disparity_from(DepthEstimate(inverse, "inverse depth"), GRID), atol=1e-4)


def test_what_is_not_a_depth_is_unknown_and_infinity_is_far() -> None:
    metres = np.array([[1, 2, 4, 8], [0, -3, np.nan, np.inf]], np.float32)
    got = disparity_from(DepthEstimate(metres, "metres"), GRID)
    np.testing.assert_array_equal(np.isnan(got), [[0, 0, 0, 0], [1, 1, 1, 0]])
    assert got[1, 3] == np.nanmin(got)
    assert (np.diff(got[0]) < 0).all()


def test_disparity_counts_as_it_is_unless_absurd() -> None:
    given = np.array([[1.5, -2.5, np.nan], [1e9, -np.inf, 0.0]], np.float32)
    got = disparity_from(DepthEstimate(given, "disparity"), GRID)
    np.testing.assert_array_equal(got, [[1.5, -2.5, np.nan], [np.nan, np.nan, 0.0]])


def test_a_wild_value_changes_no_other() -> None:
    values = ramp()
    expected = disparity_from(DepthEstimate(values, "inverse depth"), GRID)
    values[7, 7] = 1e6
    got = disparity_from(DepthEstimate(values, "inverse depth"), GRID)
    others = np.arange(values.size).reshape(values.shape) != 7 * 50 + 7
    np.testing.assert_allclose(got[others], expected[others], atol=0.01 * np.ptp(expected))
    low, high = np.percentile(got, [1, 99])
    assert got[7, 7] <= high + (OUTLIER_SPANS + 0.01) * (high - low)


def test_a_small_thing_before_a_wall_keeps_its_parallax() -> None:
    values = np.zeros((100, 100), np.float32)
    values[50:55, 50:55] = 1
    got = disparity_from(DepthEstimate(values, "inverse depth"), GRID)
    assert np.ptp(got) * 8 == pytest.approx(TOTAL_PARALLAX * 100, rel=1e-5)


@pytest.mark.parametrize("value", [0.0, 1.0, -1e30, 3e38])
def test_a_constant_map_is_flat(value: float) -> None:
    values = np.full((5, 6), value, np.float32)
    values[0, 0] = np.nan
    got = disparity_from(DepthEstimate(values, "inverse depth"), GRID)
    assert np.isnan(got[0, 0])
    assert not got.ravel()[1:].any()


def test_rounding_is_no_depth() -> None:
    values = np.float32(1e6) + np.tile(np.float32([0, 0.0625]), (8, 8))
    assert not disparity_from(DepthEstimate(values, "inverse depth"), GRID).any()


@pytest.mark.parametrize(
    "estimate",
    [
        DepthEstimate(np.full((3, 3), np.nan, np.float32), "inverse depth"),
        DepthEstimate(np.array([[0, -1, np.nan]], np.float32), "metres"),
        DepthEstimate(np.full((2, 2), np.inf, np.float32), "disparity"),
        DepthEstimate(np.zeros((0, 4), np.float32), "inverse depth"),
    ],
)
def test_nothing_known_is_told(estimate: DepthEstimate) -> None:
    with pytest.raises(InputError, match="has no known value"):
        disparity_from(estimate, GRID)


@settings(max_examples=60)
@given(
    hnp.arrays(np.float32, st.tuples(st.integers(1, 8), st.integers(1, 8)), elements=st.floats(width=32)),
    st.sampled_from(get_args(Meaning)),
)
def test_never_infinite(values: np.ndarray, meaning: Meaning) -> None:
    try:
        got = disparity_from(DepthEstimate(values, meaning), GRID)
    except InputError:
        return
    assert got.dtype == np.float32
    assert not np.isinf(got).any()
    assert not np.isnan(got).all()


def test_metres_are_told_back_from_the_disparity_that_metric_depth_became() -> None:
    metres = np.linspace(0.5, 8.0, 600, dtype=np.float32).reshape(20, 30)
    values = disparity_from(DepthEstimate(metres, "metres"), GridShape(9, 9))
    found = inverse_metres_over(DepthEstimate(metres, "metres"), values)
    assert found is not None
    slope, offset = found
    np.testing.assert_allclose(1 / (slope * values + offset), metres, rtol=1e-4)
    assert inverse_metres_over(DepthEstimate(metres, "inverse depth"), values) is None
    flat = np.full((4, 5), 2.0, np.float32)
    assert inverse_metres_over(DepthEstimate(flat, "metres"), np.zeros((4, 5), np.float32)) is None
