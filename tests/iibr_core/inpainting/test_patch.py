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


def disocclusion(front=12.0):
    """(colors, disparity, hole, photo_disparity, offset): a red square has left a hole in a checked wall."""
    disparity, photo_disparity = np.zeros(SIZE, np.float32), np.zeros(SIZE, np.float32)
    disparity[15:45, 38:50], photo_disparity[15:45, 50:62] = front, front
    hole = np.zeros(SIZE, bool)
    hole[HOLE] = True
    colors = np.where(disparity[..., None] > 0, np.float32([1, 0, 0]), weave()).astype(np.float32)
    colors[hole] = np.nan
    return colors, disparity, hole, photo_disparity, ViewOffset(0.0, 1.0)


def fineness(colors):
    return np.abs(np.diff(colors[HOLE][..., 1], axis=1)).mean()


@pytest.mark.parametrize("front", [12.0, 3.0])
def test_a_hole_gets_the_texture_of_what_lies_around_and_nothing_of_what_is_in_front(front):
    scene, plain = disocclusion(front), disocclusion(front)
    fill_patches(*scene)
    fill_background(*plain)
    truth = fineness(weave())
    assert fineness(plain[0]) < fineness(scene[0])
    assert 0.5 * truth < fineness(scene[0]) < 1.2 * truth
    assert scene[0][HOLE][..., 0].max() == 0
    np.testing.assert_array_equal(scene[1], plain[1])


def test_pixels_of_the_view_tell_what_is_in_front():
    """Half the disparity, seen from twice as far, is the same picture."""
    (colors, disparity, hole, photo_disparity, offset), farther = disocclusion(3.0), disocclusion(3.0)[0]
    fill_patches(farther, disparity / 2, hole, photo_disparity / 2, ViewOffset(0.0, 2.0))
    fill_patches(colors, disparity, hole, photo_disparity, offset)
    np.testing.assert_array_equal(farther, colors)


def test_nothing_gets_darker_than_black():
    scene = disocclusion()
    scene[0][:] = np.where(scene[0] > 0.4, np.float32(1), np.float32(0))
    fill_patches(*scene)
    assert scene[0].min() == 0


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


def test_one_search_more_would_hardly_find_better():
    """As long as neighbours do not agree yet each of them does, by a third or more."""
    colors, disparity, hole, photo_disparity, offset = disocclusion()
    fill_background(colors, disparity, hole, photo_disparity, offset)
    in_front, nearest = np.float32(2.0), np.empty(SIZE, np.float32)
    targets, number = patch._targets(disparity, hole, in_front, lambda: False)
    patch._nearest_of_patches(disparity, hole, 0, SIZE[0], nearest)
    match, cost, costs = np.full((len(targets), 2), -1, np.int32), np.empty(len(targets), np.float32), []
    args = colors, disparity, hole, nearest, in_front, number, targets, 0, len(targets)
    for step in range(patch.SEARCHES + 1):
        patch._search(*args, step, match.copy(), match, cost)
        costs.append(cost.mean())
    assert costs[-1] > 0.9 * costs[-2]


def searched(known_error, filled_error):
    """Which of two patches is found for one whose left part is known and whose larger right part was filled; errors:
    of the first and the second patch against either part.
    """
    colors, hole = np.zeros((9, 40, 3), np.float32), np.zeros((9, 40), bool)
    target, patches = (4, 5), ((4, 15), (4, 25))
    hole[:, 5:9] = True
    nearest = np.full(hole.shape, np.inf, np.float32)
    for (y, x), of_known, of_filled in zip(patches, known_error, filled_error):
        colors[:, x - RADIUS_PX : x], colors[:, x : x + RADIUS_PX + 1] = of_known, of_filled
        nearest[y, x] = 0.0
    pixels = np.array([target, (target[0], target[1] + 1)]) @ [40, 1]
    number = np.full(hole.shape, -1, np.int32)
    number.ravel()[pixels] = 0, 1
    # Its own is the first, its neighbour's the second.
    before = np.array([patches[0], (patches[1][0], patches[1][1] + 1)], np.int32)
    match, cost = np.full((2, 2), -1, np.int32), np.empty(2, np.float32)
    disparity = np.zeros(hole.shape, np.float32)
    patch._search(colors, disparity, hole, nearest, np.float32(2.0), number, pixels, 0, 1, 0, before, match, cost)
    return patches.index(tuple(map(int, match[0])))


@pytest.mark.parametrize("known_first", [True, False])
def test_what_is_known_counts_more_than_what_was_filled_which_counts_too(known_first):
    order = slice(None, None, 1 if known_first else -1)
    assert searched((0.0, 0.1)[order], (0.1, 0.0)[order]) == (0 if known_first else 1)
    assert searched((0.1, 0.1), (0.0, 0.1)[order]) == (0 if known_first else 1)


def test_of_what_patches_change_the_mean_around_is_left_out():
    """Slow and plain: what each hole pixel would change, less the mean over the hole pixels of the patch around it."""
    hole = np.random.default_rng(0).random((14, 18)) < 0.7
    targets = np.flatnonzero(hole | (np.random.default_rng(1).random(hole.shape) < 0.5))[:-9]
    number = np.full(hole.shape, -1, np.int32)
    number.ravel()[targets] = np.arange(len(targets))
    change = np.random.default_rng(2).normal(0, 1, (len(targets), 3)).astype(np.float32)
    tempered = np.full_like(change, np.nan)
    patch._temper(hole, number, targets, change, 0, len(targets), tempered)
    counted = hole & (number >= 0)
    for i, (y, x) in enumerate(zip(*np.unravel_index(targets, hole.shape))):
        around = np.s_[max(y - RADIUS_PX, 0) : y + RADIUS_PX + 1, max(x - RADIUS_PX, 0) : x + RADIUS_PX + 1]
        fine = change[i] - change[number[around][counted[around]]].mean(axis=0) if hole[y, x] else np.nan
        np.testing.assert_allclose(tempered[i], np.broadcast_to(fine, 3), atol=1e-5)


def test_cracks_are_left_as_they_were_filled():
    colors, disparity, hole, photo_disparity, offset = disocclusion()
    hole[:] = False
    hole[15:45, 50:52] = True
    colors[:, 52:] = weave()[:, 52:]
    plain = colors.copy(), disparity.copy()
    fill_patches(colors, disparity, hole, photo_disparity, offset)
    fill_background(*plain, hole, photo_disparity, offset)
    np.testing.assert_array_equal(colors, plain[0])


@pytest.mark.parametrize("size", [(1, 1), (1, 40), (5, 6), (7, 7), (40, 3)])
def test_pictures_smaller_than_a_patch_stay_as_the_continued_surface(size):
    hole = np.zeros(size, bool)
    hole[:, size[1] // 2 :] = size[1] > 1
    colors, disparity = np.full((*size, 3), 0.5, np.float32), np.zeros(size, np.float32)
    plain = colors.copy()
    fill_patches(colors, disparity, hole, disparity, ViewOffset(1.0, 1.0))
    fill_background(plain, disparity, hole, disparity, ViewOffset(1.0, 1.0))
    np.testing.assert_array_equal(colors, plain)


def test_what_surrounds_a_wide_hole_is_of_its_own_surface():
    """Right of the hole its surface goes on; left of it lies one behind, which no patch is to come from."""
    disparity, hole = np.zeros((15, 15), np.float32), np.zeros((15, 15), bool)
    disparity[:, :6], hole[6:9, 6:9] = -10.0, True
    wanted = np.zeros((15, 15), bool)
    patch._add_surroundings(disparity, hole, np.float32(0.5), np.array([7 * 15 + 7]), wanted)
    assert wanted[7, 9]
    assert not wanted[:, :6].any()
