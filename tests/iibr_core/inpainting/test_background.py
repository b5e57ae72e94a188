import numpy as np
import pytest

from iibr_core.inpainting.background import DIRECTIONS, HIDDEN_PX, SMOOTH_PX, fill_background
from iibr_core.types import ViewOffset


def smooth_slowly(colors, disparity, hole, tolerance):
    smoothed = colors.copy()
    for y, x in np.argwhere(hole):
        block = np.s_[max(y - SMOOTH_PX, 0) : y + SMOOTH_PX + 1, max(x - SMOOTH_PX, 0) : x + SMOOTH_PX + 1]
        same = hole[block] & (np.abs(disparity[block] - disparity[y, x]) <= tolerance)
        smoothed[y, x] = colors[block][same].mean(axis=0)
    return smoothed


def fill_slowly(colors, disparity, hole, photo_disparity, offset):
    height, width = hole.shape
    t, s = offset
    filled_colors, filled_disparity = colors.copy(), disparity.copy()
    for y, x in np.argwhere(hole):
        seen = []
        for i, j in DIRECTIONS:
            path = [(x + n * i, y + n * j) for n in range(1, max(height, width) + 1)]
            path = [(u, v) for u, v in path if 0 <= u < width and 0 <= v < height]
            known = [n for n, (u, v) in enumerate(path) if not hole[v, u]]
            if known:
                n = known[0] + 1 if known[0] + 1 < len(path) and not hole[path[known[0] + 1][::-1]] else known[0]
                seen.append(path[n])

        def possible(u, v, x=x, y=y):
            d = float(disparity[v, u])
            column, row = int(np.floor(x + d * s + 0.5)), int(np.floor(y + d * t + 0.5))
            inside = 0 <= column < width and 0 <= row < height
            return not inside or (photo_disparity[row, column] - d) * max(abs(s), abs(t)) > HIDDEN_PX

        farthest = min((disparity[v, u] for u, v in seen), default=0)
        chosen = [p for p in seen if possible(*p)] or [(u, v) for u, v in seen if disparity[v, u] <= farthest]
        if chosen:
            w = np.array([1 / np.hypot(u - x, v - y) for u, v in chosen])
            filled_colors[y, x] = sum(k * colors[v, u] for k, (u, v) in zip(w, chosen)) / w.sum()
            filled_disparity[y, x] = sum(k * disparity[v, u] for k, (u, v) in zip(w, chosen)) / w.sum()
    return smooth_slowly(filled_colors, filled_disparity, hole, HIDDEN_PX / max(abs(s), abs(t))), filled_disparity


def test_agrees_with_a_slow_twin():
    random = np.random.default_rng(2)
    size = (17, 19)
    colors = random.uniform(0, 1, (*size, 3)).astype(np.float32)
    disparity = random.choice([0.0, 1.0, 3.0], size).astype(np.float32)
    photo_disparity = random.choice([0.0, 1.0, 3.0], size).astype(np.float32)
    hole = random.random(size) < 0.4
    hole[5:12, 8:] = True
    offset = ViewOffset(1.0, -2.0)
    expected_colors, expected_disparity = fill_slowly(colors, disparity, hole, photo_disparity, offset)
    fill_background(colors, disparity, hole, photo_disparity, offset)
    assert colors == pytest.approx(expected_colors, abs=1e-5)
    assert disparity == pytest.approx(expected_disparity, abs=1e-5)


def test_a_disocclusion_takes_the_background_not_what_hid_it():
    photo_disparity = np.zeros((20, 40), np.float32)
    photo_disparity[:, 20:30] = 4.0
    offset = ViewOffset(0, 1)
    disparity = np.zeros((20, 40), np.float32)
    disparity[:, 16:26] = 4.0  # the foreground has moved 4 px to the left
    hole = np.zeros((20, 40), bool)
    hole[:, 26:30] = True
    colors = np.where(disparity[..., None] > 0, np.float32([1, 0, 0]), np.float32([0, 0, 1])).astype(np.float32)
    colors[hole] = 0.5
    fill_background(colors, disparity, hole, photo_disparity, offset)
    assert colors[hole] == pytest.approx(np.tile(np.float32([0, 0, 1]), (hole.sum(), 1)))
    assert disparity[hole].max() == 0


def test_the_frame_border_continues_the_surface_that_leaves_it():
    photo_disparity = np.full((12, 30), 3.0, np.float32)
    photo_disparity[:, :10] = 0.0
    disparity = np.full((12, 30), 3.0, np.float32)
    disparity[:, :7] = 0.0
    hole = np.zeros((12, 30), bool)
    hole[:, 27:] = True
    colors = np.where(disparity[..., None] > 0, np.float32([1, 0, 0]), np.float32([0, 0, 1])).astype(np.float32)
    fill_background(colors, disparity, hole, photo_disparity, ViewOffset(0, 1))
    assert colors[:, 27:] == pytest.approx(np.tile(np.float32([1, 0, 0]), (12, 3, 1)))


def test_a_view_that_is_all_hole_stays_and_stays_finite():
    colors, disparity = np.zeros((5, 6, 3), np.float32), np.zeros((5, 6), np.float32)
    fill_background(colors, disparity, np.ones((5, 6), bool), disparity, ViewOffset(50, 50))
    assert colors.max() == 0
    assert np.isfinite(disparity).all()
