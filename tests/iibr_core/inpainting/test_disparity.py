import math

import numpy as np
import pytest

from iibr_core.inpainting import disparity_by_color
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.inpainting.disparity_holes import OPEN_LINE, SHORTNESS, STEP_LENGTHS, fill_disparity_holes

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
    lone = np.full((9, 9), np.nan, np.float32)
    lone[0, 0] = 3.0
    assert (fill_disparity_holes(lone) == 3.0).all(), "what no line reaches is reached in a second round"


RED, BLUE = np.float32([0.8, 0.1, 0.1]), np.float32([0.1, 0.2, 0.8])


def cable_before_wall():
    """A red cable three pixels wide at disparity 9 before a blue wall at 2."""
    photo, truth = np.tile(BLUE, (40, 60, 1)), np.full((40, 60), 2.0, np.float32)
    photo[:, 28:31], truth[:, 28:31] = RED, 9.0
    noise = np.random.default_rng(3).normal(0, 0.01, photo.shape)
    return (photo + noise).astype(np.float32), truth


def slow_vote(photo, values, y, x):
    """Return the mean of who voted for the mode of a histogram, votes by nearness and likeness."""
    reach = disparity_by_color.VOTE_REACH_PX
    near = [(v, u) for v, u in np.argwhere(~np.isnan(values)) if max(abs(v - y), abs(u - x)) <= reach]
    d = np.array([values[p] for p in near], np.float64)
    apart = np.array([np.sum((photo[p] - photo[y, x]) ** 2) for p in near])
    away = np.array([(v - y) ** 2 + (u - x) ** 2 for v, u in near])
    likeness = np.exp(-apart / (2 * disparity_by_color.COLOR_SIGMA**2)) + disparity_by_color.UNLIKE_WEIGHT
    votes = likeness * np.exp(-away / (2 * disparity_by_color.SPREAD_PX**2))
    bins = ((d - d.min()) * (disparity_by_color.VOTE_BINS - 1) / np.ptp(d)).astype(int)
    total = np.bincount(bins, votes, disparity_by_color.VOTE_BINS)
    elected = np.argmax(np.convolve(total, [disparity_by_color.SIDE_BINS, 1, disparity_by_color.SIDE_BINS], "same"))
    return np.average(d, weights=votes * (abs(bins - elected) <= 1))


def test_lone_pixels_get_what_the_slow_vote_says():
    photo, truth = cable_before_wall()
    given = truth + np.random.default_rng(5).normal(0, 0.3, truth.shape).astype(np.float32)
    unknown = np.zeros(truth.shape, np.bool_)
    unknown[::10, ::9] = True
    values = np.where(unknown, np.float32(np.nan), given)
    expected = [slow_vote(photo, values, y, x) for y, x in np.argwhere(unknown)]
    np.testing.assert_allclose(fill_disparity_by_color(photo, values)[unknown], expected, rtol=1e-5)


def test_a_cable_is_whole_again_where_half_of_it_is_unknown():
    photo, truth = cable_before_wall()
    values = truth.copy()
    values[10:30, 26:30] = np.nan
    np.testing.assert_allclose(fill_disparity_by_color(photo, values), truth, atol=1e-4)


def test_what_is_far_from_all_that_is_known_comes_from_the_background(monkeypatch):
    monkeypatch.setattr(disparity_by_color, "MAX_VOTE_ROUNDS", 2)
    values = np.full((9, 40), np.nan, np.float32)
    values[:, 0], values[:, -1] = 3.0, 1.0
    filled = fill_disparity_by_color(np.full((9, 40, 3), 0.5, np.float32), values)
    assert (filled[:, :3] == 3).all()
    assert filled[:, 8:] == pytest.approx(1, abs=1e-3), "though the left end is nearer to most of them"
