"""Holes of disparity maps, filled from behind, against a slow twin that walks along each line."""

import math

import numpy as np
import pytest

from iibr_core.inpainting.disparity_holes import OPEN_LINE, SHORTNESS, STEP_LENGTHS, fill_disparity_holes, say_filled

LINES = ((0, 1), (1, 0), (1, 1), (1, -1))
"""Horizontal, vertical, falling diagonal, rising diagonal: (down, right)."""


def slow_fill(values):
    filled = values.copy()
    height, width = values.shape
    for y, x in np.argwhere(np.isnan(values)):
        total = weights = 0.0
        found = []
        for (down, right), length in zip(LINES, STEP_LENGTHS):
            ends = []
            for side in (-1, 1):
                for far in range(1, height + width):
                    v, u = y + side * far * down, x + side * far * right
                    if not (0 <= v < height and 0 <= u < width):
                        break
                    if not math.isnan(values[v, u]):
                        ends.append((values[v, u], far))
                        break
            if len(ends) == 2:
                found.append((min(end for end, _ in ends), length * sum(far for _, far in ends)))
            elif ends:
                found.append((ends[0][0], OPEN_LINE * length * ends[0][1]))
        for value, span in found:
            total, weights = total + value / span**SHORTNESS, weights + 1 / span**SHORTNESS
        filled[y, x] = total / weights if found else np.nan
    return filled


@pytest.mark.parametrize("share", [0.3, 0.8])
def test_the_farther_end_of_the_shortest_way_across_counts(share):
    rng = np.random.default_rng(6)
    values = rng.uniform(1, 5, (13, 17)).astype(np.float32)
    values[rng.random(values.shape) < share] = np.nan
    values[4:9, 6:12] = np.nan
    filled, expected = fill_disparity_holes(values), slow_fill(values.astype(float))
    reached = ~np.isnan(expected)
    np.testing.assert_allclose(filled[reached], expected[reached], rtol=1e-5)
    known = ~np.isnan(values)
    np.testing.assert_array_equal(filled[known], values[known])
    assert np.isfinite(filled).all()


def test_what_no_line_reaches_is_reached_in_a_second_round():
    values = np.full((9, 9), np.nan, np.float32)
    values[0, 0] = 3.0
    assert (fill_disparity_holes(values) == 3.0).all()


def test_nothing_known_is_refused_and_shares_are_told():
    with pytest.raises(ValueError, match="no known value"):
        fill_disparity_holes(np.full((3, 3), np.nan, np.float32))
    assert say_filled("a map", 0.034) == "3.4 % of a map is unknown and was filled from around it."
    assert say_filled("a map", 0.96).startswith("Only 4 % of a map is known")
