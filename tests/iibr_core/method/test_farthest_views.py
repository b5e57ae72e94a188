"""Which views complete a ray set, and how far beyond the frame they see."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from iibr_core.method.farthest_views import (
    LOOKUP_MARGIN_PX,
    MAX_MARGIN,
    farthest_views,
    outer_views,
    outer_views_of_grid,
    outpainting_margins,
)
from iibr_core.types import GridShape, ViewOffset

UPPER_LEFT, LOWER_RIGHT = ViewOffset(-2.0, -1.0), ViewOffset(1.0, 3.0)


def test_they_are_the_corners_around_all_viewpoints_opposite_ones_in_pairs():
    found = outer_views([ViewOffset(0.5, -1.0), UPPER_LEFT, ViewOffset(0.0, 2.0), LOWER_RIGHT])
    assert found == [(-2, -1), (1, 3), (-2, 3), (1, -1)]
    assert farthest_views(found) == 3
    assert outer_views([]) == []
    assert outer_views([ViewOffset(0.0, 2.0)]) == [(0, 2)]
    assert farthest_views([]) == farthest_views([ViewOffset(0.0, -0.5)]) == 1


@pytest.mark.parametrize("grid", [GridShape(*at) for at in product((1, 2, 3, 4, 9), repeat=2)], ids=str)
def test_those_of_a_grid_are_views_of_it_each_once_and_never_the_photo_s(grid):
    bottom, right = grid.rows - 1, grid.columns - 1
    indices = dict.fromkeys([(0, 0), (bottom, right), (0, right), (bottom, 0)])
    expected = [grid.offset(*index) for index in indices if index != grid.centre]
    every = [grid.offset(*index) for index in np.ndindex(*grid)]
    assert outer_views_of_grid(grid) == outer_views(every) == expected
    assert farthest_views(expected) == max(1.0, *(abs(part) for offset in every for part in offset))


@pytest.mark.parametrize("disparity", [1.5, -1.5])
def test_margins_are_what_views_see_beyond_the_frame(disparity):
    """The view at (t, s) shows at y what the photo would show at y + d t."""
    margins = outpainting_margins(np.full((80, 90), disparity, np.float32), [UPPER_LEFT, LOWER_RIGHT])
    far = {"top": 3.0, "bottom": 1.5, "left": 1.5, "right": 4.5}
    if disparity < 0:
        far = {"top": 1.5, "bottom": 3.0, "left": 4.5, "right": 1.5}
    assert margins._asdict() == {side: int(np.ceil(reach)) + LOOKUP_MARGIN_PX for side, reach in far.items()}


def test_each_side_s_own_disparity_counts_and_nothing_where_no_view_looks_out():
    disparity = np.zeros((40, 400), np.float32)
    disparity[:, -1] = 2.0
    assert outpainting_margins(disparity, [UPPER_LEFT, LOWER_RIGHT]) == (0, 0, 0, 6 + LOOKUP_MARGIN_PX)
    assert outpainting_margins(disparity, [ViewOffset(0.0, -3.0)]) == (0, 0, 0, 0)


def test_margins_are_bounded_and_wild_pixels_do_not_count():
    wide = outpainting_margins(np.full((80, 120), 50.0, np.float32), [UPPER_LEFT, LOWER_RIGHT])
    assert wide == (MAX_MARGIN * 80, MAX_MARGIN * 80, MAX_MARGIN * 120, MAX_MARGIN * 120)
    disparity = np.zeros((400, 400), np.float32)
    disparity[0, :3] = 9.0
    assert outpainting_margins(disparity, [UPPER_LEFT, LOWER_RIGHT]).top == 0
