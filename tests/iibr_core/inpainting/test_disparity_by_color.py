"""Unknown disparity goes with what looks like it."""

import numpy as np
import pytest

from iibr_core.inpainting import disparity_by_color
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color
from iibr_core.runtime.work import Cancelled, stoppable

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


def test_without_colours_that_tell_the_nearest_decide():
    values = np.full((20, 30), np.nan, np.float32)
    values[:, :5], values[:, 25:] = 1.0, 7.0
    filled = fill_disparity_by_color(np.full((20, 30, 3), 0.5, np.float32), values)
    assert (filled[:, :14] == 1).all()
    assert (filled[:, 16:] == 7).all()


def test_what_is_far_from_all_that_is_known_comes_from_the_background(monkeypatch):
    monkeypatch.setattr(disparity_by_color, "MOST_VOTE_ROUNDS", 2)
    values = np.full((9, 40), np.nan, np.float32)
    values[:, 0], values[:, -1] = 3.0, 1.0
    filled = fill_disparity_by_color(np.full((9, 40, 3), 0.5, np.float32), values)
    assert (filled[:, :3] == 3).all()
    assert filled[:, 8:] == pytest.approx(1, abs=1e-3), "though the left end is nearer to most of them"


def test_bad_arguments_and_a_stop_are_told():
    photo, truth = cable_before_wall()
    with pytest.raises(ValueError, match="no known value"):
        fill_disparity_by_color(photo, np.full_like(truth, np.nan))
    values = truth.copy()
    values[3, 3] = np.nan
    with pytest.raises(Cancelled), stoppable(lambda: True):
        fill_disparity_by_color(photo, values)
