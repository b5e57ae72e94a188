import numpy as np
import pytest

from iibr_core.inpainting import patch
from iibr_core.inpainting.background import fill_background
from iibr_core.inpainting.patch import RADIUS_PX, fill_patches
from iibr_core.types import ViewOffset

SIZE = (60, 90)
HOLE = np.s_[15:45, 50:62]


def weave():
    """Green and blue checks, no two alike."""
    y, x = np.indices(SIZE)
    checks = 0.4 + 0.2 * (((y // 3) + (x // 3)) % 2) + np.random.default_rng(3).uniform(-0.03, 0.03, SIZE)
    return (checks[..., None] * np.float32([0, 1, 1])).astype(np.float32)


def disocclusion():
    """(colors, disparity, hole, photo_disparity, offset): a red square has left a hole in a checked wall."""
    disparity, photo_disparity = np.zeros(SIZE, np.float32), np.zeros(SIZE, np.float32)
    disparity[15:45, 38:50], photo_disparity[15:45, 50:62] = 12.0, 12.0
    hole = np.zeros(SIZE, bool)
    hole[HOLE] = True
    colors = np.where(disparity[..., None] > 0, np.float32([1, 0, 0]), weave()).astype(np.float32)
    colors[hole] = np.nan
    return colors, disparity, hole, photo_disparity, ViewOffset(0.0, 1.0)


def fineness(colors):
    return np.abs(np.diff(colors[HOLE][..., 1], axis=1)).mean()


def test_a_hole_gets_the_texture_of_what_lies_around_and_nothing_of_what_is_in_front():
    scene, plain = disocclusion(), disocclusion()
    fill_patches(*scene)
    fill_background(*plain)
    truth = fineness(weave())
    assert fineness(plain[0]) < fineness(scene[0])
    assert 0.5 * truth < fineness(scene[0]) < 1.2 * truth
    assert scene[0][HOLE][..., 0].max() == 0
    np.testing.assert_array_equal(scene[1], plain[1])


def test_a_line_that_ends_at_the_frame_s_hole_goes_on_into_it():
    colors = np.zeros((*SIZE, 3), np.float32)
    colors[30:] = 0.5
    hole = np.zeros(SIZE, bool)
    hole[:, 78:] = True
    disparity = np.full(SIZE, 12.0, np.float32)
    fill_patches(colors, disparity, hole, disparity, ViewOffset(0.0, 1.0))
    steps = np.abs(np.diff(colors[20:40, 84, 0]))
    assert steps.max() > 0.4
    assert steps.sum() == pytest.approx(0.5, abs=0.05)


def test_matches_are_whole_never_in_front_and_as_good_as_they_say():
    colors, disparity, hole, _, _ = disocclusion()
    fill_background(colors, disparity, hole, disocclusion()[3], ViewOffset(0.0, 1.0))
    in_front, r = np.float32(2.0), RADIUS_PX
    targets, number = patch._targets(disparity, hole, in_front, lambda: False)
    nearest = np.empty(SIZE, np.float32)
    patch._nearest_of_patches(disparity, hole, 0, 23, nearest)
    patch._nearest_of_patches(disparity, hole, 23, SIZE[0], nearest)
    before = np.full((len(targets), 2), -1, np.int32)
    match, cost = before.copy(), np.empty(len(targets), np.float32)
    args = colors, disparity, hole, nearest, in_front, number, targets, 0, len(targets)
    patch._search(*args, 0, before, match, cost)
    first_cost = cost.copy()
    patch._search(*args, 1, match.copy(), match, cost)
    assert (cost <= first_cost).all()
    assert (match >= 0).mean() > 0.9
    for target, (v, u), said in list(zip(targets, match, cost))[::7]:
        if v < 0:
            continue
        y, x = divmod(int(target), SIZE[1])
        source = np.s_[v - r : v + r + 1, u - r : u + r + 1]
        assert colors[source].shape == (2 * r + 1, 2 * r + 1, 3)
        assert not hole[source].any()
        assert disparity[source].max() <= disparity[y, x] + in_front
        assert nearest[v, u] == disparity[source].max()
        taps = [(j, k) for j in range(-r, r + 1) for k in range(-r, r + 1) if 0 <= y + j < 60 and 0 <= x + k < 90]
        taps = [(j, k) for j, k in taps if disparity[y + j, x + k] <= disparity[y, x] + in_front]
        squares = [((colors[y + j, x + k] - colors[v + j, u + k]) ** 2).sum() for j, k in taps]
        weights = [patch.HOLE_WEIGHT if hole[y + j, x + k] else 1.0 for j, k in taps]
        assert said == pytest.approx(np.average(squares, weights=weights), rel=1e-4, abs=1e-7)


@pytest.mark.parametrize("size", [(1, 1), (1, 40), (5, 6), (7, 7), (40, 3)])
def test_pictures_smaller_than_a_patch_stay_as_the_continued_surface(size):
    hole = np.zeros(size, bool)
    hole[:, size[1] // 2 :] = size[1] > 1
    colors, disparity = np.full((*size, 3), 0.5, np.float32), np.zeros(size, np.float32)
    plain = colors.copy()
    fill_patches(colors, disparity, hole, disparity, ViewOffset(1.0, 1.0))
    fill_background(plain, disparity, hole, disparity, ViewOffset(1.0, 1.0))
    np.testing.assert_array_equal(colors, plain)
