"""Rectangles: what lies inside."""

from __future__ import annotations

import pytest

from iibr_core.scenes.rect import Rect


@pytest.mark.parametrize(
    ("x", "y", "is_inside"),
    [(1, 2, True), (3.9, 5.9, True), (0.9, 3, False), (4, 3, False), (2, 1.9, False), (2, 6, False)],
)
def test_the_near_edges_belong_to_it_and_the_far_ones_do_not(x: float, y: float, is_inside: bool) -> None:
    """So that of two side by side just one has their common edge."""
    assert Rect(1, 2, 3, 4).contains(x, y) == is_inside
