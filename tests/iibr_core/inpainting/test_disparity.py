import numpy as np
import pytest

from iibr_core.inpainting import disparity_by_color
from iibr_core.inpainting.disparity_by_color import fill_disparity_by_color

"""Horizontal, vertical, falling diagonal, rising diagonal: (down, right)."""


RED, BLUE = np.float32([0.8, 0.1, 0.1]), np.float32([0.1, 0.2, 0.8])


def cable_before_wall():
    """A red cable three pixels wide at disparity 9 before a blue wall at 2."""
    photo, truth = np.tile(BLUE, (40, 60, 1)), np.full((40, 60), 2.0, np.float32)
    photo[:, 28:31], truth[:, 28:31] = RED, 9.0
    noise = np.random.default_rng(3).normal(0, 0.01, photo.shape)
    return (photo + noise).astype(np.float32), truth


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
