"""Crumbs of a map, against a slow twin."""

import numpy as np
import pytest

from iibr_core.depth.edges.crumbs import MOST_PX, MOST_SHARE, fill_crumbs
from iibr_core.runtime.tiling import Cancelled, never

WALL, NEAR, STEP = 1.0, 9.0, 0.5
GREY = np.full((40, 60, 3), 0.5, np.float32)


def wall():
    return np.full((40, 60), WALL, np.float32)


def slow_crumbs(values, step):
    """Whether MOST_PX pixels or fewer hang together: grown until nothing is added."""
    found = np.zeros(values.shape, np.bool_)
    for start in np.ndindex(*values.shape):
        together, before = {start}, set()
        while together != before:
            before = set(together)
            for y, x in before:
                around = {(v, u) for v in (y - 1, y, y + 1) for u in (x - 1, x, x + 1)}
                inside = {at for at in around if at[0] in range(len(values)) and at[1] in range(len(values[0]))}
                together |= {at for at in inside if abs(values[at] - values[y, x]) <= step}
        found[start] = len(together) <= MOST_PX
    return found


def test_only_what_a_flood_finds_small_changes():
    random = np.random.default_rng(3)
    given = np.where(random.random((16, 18)) < 0.05, NEAR, WALL) + random.uniform(0, 0.4 * STEP, (16, 18))
    given = given.astype(np.float32)
    given[3, 4:8] = NEAR
    crumbs = slow_crumbs(given, STEP)
    assert 0 < crumbs.sum() < (given > 5).sum()
    filled = fill_crumbs(GREY[:16, :18], given, STEP, never)
    np.testing.assert_array_equal(filled != given, crumbs)
    assert filled[crumbs].max() < WALL + STEP


def test_a_crumb_goes_with_what_looks_like_it():
    photo, values = GREY.copy(), wall()
    photo[:, 30:], values[:, 30:] = 0.9, NEAR
    values[20, 29] = values[20, 31] = 5.0
    filled = fill_crumbs(photo, values, STEP, never)
    assert filled[20, 29] == pytest.approx(WALL)
    assert filled[20, 31] == pytest.approx(NEAR)


@pytest.mark.parametrize("way", [(0, 1), (1, 0), (1, 1), (1, -1)])
def test_thin_things_are_none(way):
    values = wall()
    for k in range(MOST_PX + 1):
        values[10 + k * way[0], 30 + k * way[1]] = NEAR
    np.testing.assert_array_equal(fill_crumbs(GREY, values, STEP, never), values)


def test_as_many_as_count_as_a_crumb_go():
    values = wall()
    values[10, 30 : 30 + MOST_PX] = NEAR
    np.testing.assert_array_equal(fill_crumbs(GREY, values, STEP, never), wall())


def test_pixels_that_differ_by_the_very_step_hang_together():
    values = wall()
    values[10, 30:34] = NEAR, NEAR + STEP, NEAR, NEAR + STEP
    np.testing.assert_array_equal(fill_crumbs(GREY, values, STEP, never), values)


@pytest.mark.parametrize("is_more", [False, True])
def test_a_map_of_which_more_is_crumbs_is_noise(is_more):
    values = wall()
    lone = np.zeros(values.shape, np.bool_)
    lone[::2, ::2] = True
    places = np.flatnonzero(lone)[: round(MOST_SHARE * values.size) + is_more]
    values.ravel()[places] = NEAR
    np.testing.assert_array_equal(fill_crumbs(GREY, values, STEP, never), values if is_more else wall())


@pytest.mark.parametrize("size", [(1, 1), (1, 3), (2, 9), (40, 60)])
def test_noise_and_tiny_maps_stay(size):
    values = np.random.default_rng(0).uniform(-90, 90, size).astype(np.float32)
    np.testing.assert_array_equal(fill_crumbs(GREY[: size[0], : size[1]], values, STEP, never), values)


def test_a_stop_is_heard():
    with pytest.raises(Cancelled):
        fill_crumbs(GREY, wall(), STEP, lambda: True)
