"""Maps of several views, held against each other."""

import numpy as np

from iibr_core.depth.multi_view.agreement import AGREE_PX, find_confirmed, reconcile
from iibr_core.types import ViewOffset

OFFSETS = [ViewOffset(0.0, -2.0), ViewOffset(0.0, 0.0), ViewOffset(1.0, 2.0)]


def slow_confirmed(maps, index):
    result = np.zeros(maps[0].shape, bool)
    for y, x in np.ndindex(*maps[0].shape):
        having = through = 0
        for other, at in enumerate(OFFSETS):
            if other == index:
                continue
            t, s = at.t - OFFSETS[index].t, at.s - OFFSETS[index].s
            d = maps[index][y, x]
            row, column = (
                round(float(np.float32(y) - d * np.float32(t))),
                round(float(np.float32(x) - d * np.float32(s))),
            )
            if not (0 <= row < len(result) and 0 <= column < len(result[0])):
                continue
            nearer = maps[other][row, column] - d
            having += abs(nearer) <= np.float32(AGREE_PX / max(abs(t), abs(s)))
            through += nearer < -np.float32(AGREE_PX / max(abs(t), abs(s)))
        result[y, x] = having > 0 and having >= through
    return result


def test_it_confirms_what_the_plain_definition_does():
    maps = list(np.random.default_rng(1).uniform(-2, 2, (3, 20, 26)).astype(np.float32))
    for index in range(3):
        confirmed = find_confirmed(maps, OFFSETS, index)
        assert 0 < confirmed.mean() < 1
        assert (confirmed == slow_confirmed(maps, index)).all()


def test_a_wrong_patch_takes_the_disparity_of_what_looks_like_it():
    maps = [np.full((30, 40), 1.0, np.float32) for _ in OFFSETS]
    maps[1][10:14, 10:14] = 5.0
    views = [np.full((30, 40, 3), 90, np.uint8)] * 3
    assert all((values == 1.0).all() for values in reconcile(views, maps, OFFSETS))


def test_maps_that_share_nothing_stay_as_they_are():
    maps = [np.full((8, 8), value, np.float32) for value in (-900.0, 0.0, 900.0)]
    kept = reconcile([np.zeros((8, 8, 3), np.uint8)] * 3, maps, OFFSETS)
    assert all((a == b).all() for a, b in zip(kept, maps))


def test_maps_agree_within_a_pixel_of_the_other_view():
    """Two steps away, disparities may differ by half a pixel a step."""
    maps = [np.full((6, 40), 1.0, np.float32), np.repeat(np.float32([1.0, 1.4, 1.6, 0.6, 0.4]), 8) * np.ones((6, 1))]
    confirmed = find_confirmed([maps[0], maps[1].astype(np.float32)], OFFSETS[:2], 0)
    # The first map's pixels lie two further to the left in the second.
    expected = np.repeat([True, True, False, True, False], 8)
    np.testing.assert_array_equal(confirmed[:, 2:], np.tile(expected, (6, 1))[:, :-2])
