"""Lone disparities between two surfaces are filled by colour, in maps that have many."""

import numpy as np

from iibr_core.depth.edges.lone import _find_lone, fill_lone

RED, BLUE = np.float32([0.8, 0.1, 0.1]), np.float32([0.1, 0.2, 0.8])
NEAR, FAR, EDGE = 9.0, 2.0, 0.3


def disc(size=64):
    """Return a photo of a red disc before a blue wall, slightly noisy, and its disparity."""
    y, x = np.mgrid[:size, :size]
    inside = (x - size / 2) ** 2 + (y - size / 2) ** 2 < (size / 4) ** 2
    photo = np.where(inside[..., None], RED, BLUE) + np.random.default_rng(5).normal(0, 0.01, (size, size, 3))
    return photo.astype(np.float32), np.where(inside, NEAR, FAR).astype(np.float32)


def test_lone_disparities_get_those_of_their_colour():
    photo, truth = disc()
    given = 0.5 * (truth + np.roll(truth, 1, axis=1))
    filled, holes = fill_lone(photo, given, np.zeros(truth.shape, np.bool_), EDGE)
    assert (np.abs(given - truth) > 1).sum() > 50
    assert (np.abs(filled - truth) > 1).sum() == 0
    assert (holes == (filled != given)).all()


def test_a_lone_pixel_is_none_of_its_surfaces_but_a_thin_thing_is_one():
    values = np.full((40, 40), FAR, np.float32)
    values[:, 21:] = NEAR
    values[10, 20] = 5.0
    lone, between = _find_lone(values, EDGE)
    assert np.argwhere(lone).tolist() == [[10, 20]]
    assert between == 1
    values[11, 20:22] = values[12, 19:22] = values[13:, 19:22] = 5.0
    assert not _find_lone(values, EDGE)[0].any()
