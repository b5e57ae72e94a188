"""Filling of holes of a view, against a slow twin and in scenes where the answer is known."""

import numpy as np
import pytest

from iibr_core.inpainting.background import MEDIAN_PX, SMOOTH_STEPS_PX, WIDE_PX, continues_in_front, fill_background
from iibr_core.inpainting.nearest_known import DIRECTIONS
from iibr_core.surfaces import EDGE_PX, SAME_SURFACE_PX
from iibr_core.types import ViewOffset
from tests.iibr_core.inpainting.test_patch_synthesis import copy_slowly


def agree_slowly(disparity, hole):
    agreed = disparity.copy()
    for y, x in np.argwhere(hole):
        block = np.s_[max(y - MEDIAN_PX, 0) : y + MEDIAN_PX + 1, max(x - MEDIAN_PX, 0) : x + MEDIAN_PX + 1]
        around = np.sort(disparity[block][hole[block]])
        agreed[y, x] = around[(len(around) - 1) // 2]
    return agreed


def smooth_slowly(colors, hole, reach, step):
    smoothed = colors.copy()
    for y, x in np.argwhere(hole):
        if reach[y, x] >= step:
            at = [(y + j * step, x + k * step, (2 - abs(j)) * (2 - abs(k))) for j in (-1, 0, 1) for k in (-1, 0, 1)]
            inside = [a for a in at if 0 <= a[0] < hole.shape[0] and 0 <= a[1] < hole.shape[1] and hole[a[:2]]]
            smoothed[y, x] = np.average([colors[a[:2]] for a in inside], axis=0, weights=[a[2] for a in inside])
    return smoothed


def around_slowly(hole, y, x):
    """Return the nearest known (x, y) in each direction."""
    height, width = hole.shape
    seen = []
    for i, j in DIRECTIONS:
        path = [(x + n * i, y + n * j) for n in range(1, max(height, width) + 1)]
        seen += [(u, v) for u, v in path if 0 <= u < width and 0 <= v < height and not hole[v, u]][:1]
    return seen


def is_possible(d, photo_disparity, offset, y, x):
    """Whether a surface of disparity d could lie there unseen by the photo."""
    height, width = photo_disparity.shape
    column, row = int(np.floor(x + d * offset.s + 0.5)), int(np.floor(y + d * offset.t + 0.5))
    inside = 0 <= column < width and 0 <= row < height
    return not inside or (photo_disparity[row, column] - d) * max(map(abs, offset)) > SAME_SURFACE_PX


def fill_slowly(colors, disparity, hole, photo_disparity, offset):
    parallax = max(map(abs, offset))
    one_surface = EDGE_PX / parallax
    filled_colors, filled_disparity, reach = colors.copy(), disparity.copy(), np.full(hole.shape, np.inf)
    for y, x in np.argwhere(hole):
        seen = around_slowly(hole, y, x)
        possible = [(u, v) for u, v in seen if is_possible(float(disparity[v, u]), photo_disparity, offset, y, x)]
        farthest = min((disparity[v, u] for u, v in seen), default=0)
        chosen = possible or [(u, v) for u, v in seen if disparity[v, u] <= farthest]
        if chosen:
            reach[y, x] = min(np.hypot(u - x, v - y) for u, v in seen)
            w = np.array([1 / np.hypot(u - x, v - y) for u, v in chosen])
            d = np.array([disparity[v, u] for u, v in chosen])
            filled_colors[y, x] = sum(k * colors[v, u] for k, (u, v) in zip(w, chosen)) / w.sum()
            alike = np.abs(d[:, None] - d) <= one_surface
            mine = alike[max(range(len(d)), key=lambda k: (round((alike[k] * w).sum(), 9), -d[k]))]
            filled_disparity[y, x] = (w * d)[mine].sum() / w[mine].sum()
    for step in SMOOTH_STEPS_PX:
        filled_colors = smooth_slowly(filled_colors, hole, reach, step)
    agreed = agree_slowly(filled_disparity, hole)
    wide = np.zeros_like(hole)
    for y, x in np.argwhere(hole & (reach >= WIDE_PX)):
        wide[max(y - 2, 0) : y + 3, max(x - 2, 0) : x + 3] = True
    return copy_slowly(filled_colors, agreed, wide & hole, one_surface), agreed


def test_agrees_with_a_slow_twin():
    random = np.random.default_rng(2)
    size = (27, 31)
    colors = (0.3 + 0.4 * random.uniform(0, 1, (*size, 3))).astype(np.float32)
    disparity = random.choice([0.0, 1.0, 3.0], size, p=[0.7, 0.2, 0.1]).astype(np.float32)
    photo_disparity = random.choice([0.0, 1.0, 3.0], size).astype(np.float32)
    hole = random.random(size) < 0.02
    hole[5:12, 12:] = True
    offset = ViewOffset(1.0, -2.0)
    expected_colors, expected_disparity = fill_slowly(colors, disparity, hole, photo_disparity, offset)
    fill_background(colors, disparity, hole, photo_disparity, offset)
    assert colors == pytest.approx(expected_colors, abs=1e-5)
    assert disparity == pytest.approx(expected_disparity, abs=1e-5)


def test_what_goes_on_in_front_is_weighed_like_a_slow_twin():
    random = np.random.default_rng(4)
    size = (27, 31)
    disparity = random.choice([0.0, 2.0, 3.0], size).astype(np.float32)
    photo_disparity = random.choice([0.0, 2.5, 4.0], size).astype(np.float32)
    hole = random.random(size) < 0.1
    hole[5:12, 12:] = True
    offset = ViewOffset(1.0, -2.0)
    expected = np.zeros(size, bool)
    for y, x in np.argwhere(hole):
        balance = 0.0
        for u, v in around_slowly(hole, y, x):
            if is_possible(float(disparity[v, u]), photo_disparity, offset, y, x):
                in_front = disparity[v, u] > disparity[y, x] + EDGE_PX / 2
                balance += (1 if in_front else -1) / np.hypot(u - x, v - y)
        expected[y, x] = balance > 0
    assert expected.any()
    np.testing.assert_array_equal(continues_in_front(disparity, hole, photo_disparity, offset), expected)


def test_a_disocclusion_takes_the_background_not_what_hid_it():
    photo_disparity = np.zeros((20, 40), np.float32)
    photo_disparity[:, 20:30] = 4.0
    offset = ViewOffset(0.0, 1.0)
    disparity = np.zeros((20, 40), np.float32)
    disparity[:, 16:26] = 4.0  # the foreground has moved 4 px to the left
    hole = np.zeros((20, 40), bool)
    hole[:, 26:30] = True
    colors = np.where(disparity[..., None] > 0, np.float32([1, 0, 0]), np.float32([0, 0, 1])).astype(np.float32)
    colors[hole] = 0.5
    fill_background(colors, disparity, hole, photo_disparity, offset)
    assert colors[hole] == pytest.approx(np.tile(np.float32([0, 0, 1]), (hole.sum(), 1)))
    assert disparity[hole].max() == 0


def test_a_view_that_is_all_hole_stays_and_stays_finite():
    colors, disparity = np.zeros((5, 6, 3), np.float32), np.zeros((5, 6), np.float32)
    fill_background(colors, disparity, np.ones((5, 6), bool), disparity, ViewOffset(50.0, 50.0))
    assert colors.max() == 0
    assert np.isfinite(disparity).all()
