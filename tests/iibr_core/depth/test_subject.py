"""What a portrait is focused on."""

from __future__ import annotations

import numpy as np
import pytest

from iibr_core.depth.subject import subject_disparity

FAR, NEAR = 1.5, 2.7


def wall(seed: int = 0) -> np.ndarray:
    """A wall that comes a little nearer downwards, as estimated maps have it."""
    noise = np.random.default_rng(seed).normal(0, 0.02, (60, 80))
    return (FAR + np.linspace(0, 0.3, 60)[:, None] + noise).astype(np.float32)


def test_a_dog_that_fills_a_fifth_of_the_middle_is_the_subject_and_not_the_wall_behind_it() -> None:
    disparity = wall()
    disparity[30:, 25:45] = NEAR
    disparity[50:] = 4.3  # the basket, in front but not in the middle
    assert subject_disparity(disparity) == pytest.approx(NEAR)


def test_a_floor_and_a_wall_behind_a_twig_are_focused_on_in_their_middle() -> None:
    floor = np.linspace(0, 4, 61, dtype=np.float32)[:, None].repeat(80, 1)
    assert subject_disparity(floor) == pytest.approx(4 * 0.46, abs=0.1)
    disparity = wall()
    assert subject_disparity(disparity) == pytest.approx(FAR + 0.14, abs=0.05)
    disparity[:, 40:42] = 6.0
    assert subject_disparity(disparity) < FAR + 0.3


@pytest.mark.parametrize("size", [(1, 1), (1, 9), (2, 3)])
def test_the_smallest_pictures_have_one_too(size: tuple[int, int]) -> None:
    assert subject_disparity(np.full(size, NEAR, np.float32)) == pytest.approx(NEAR)
    assert subject_disparity(np.full(size, np.nan, np.float32)) == 0.0
