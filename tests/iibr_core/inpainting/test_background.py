from itertools import product

import numpy as np
import pytest

from iibr_core.inpainting.background import MEDIAN_PX, SMOOTH_STEPS_PX, WIDE_PX, continues_in_front, fill_background
from iibr_core.inpainting.nearest_known import DIRECTIONS, number_pixels
from iibr_core.inpainting.patch_synthesis import (
    FINE_TEXTURE_PX,
    FIRST_PATCH_WEIGHT,
    FIT,
    GUESS,
    MAX_TEXTURE,
    MIN_TRUST,
    MISSING,
    PATCH_BLOCK_PX,
    RADIUS_PX,
    SEARCH_PX,
    STEP_PX,
    copy_patches,
)
from iibr_core.surfaces import EDGE_PX, SAME_SURFACE_PX
from iibr_core.types import ViewOffset

ONE_SURFACE = 0.5


def window(size, y, x, radius):
    """Return the pixels so far around one, within an image."""
    rows = range(max(y - radius, 0), min(y + radius + 1, size[0]))
    return list(product(rows, range(max(x - radius, 0), min(x + radius + 1, size[1]))))


def steps_beside(size, y, x):
    beside = [(y - 1, x), (y + 1, x), (y, x - 1), (y, x + 1)]
    return [(v, u) for v, u in beside if 0 <= v < size[0] and 0 <= u < size[1]]


def copy_slowly(smooth, disparity, hole, one_surface):
    """Return what `copy_patches` makes of a smoothly filled image, which stays as it is."""
    size, colors, trust = hole.shape, smooth.astype(np.float64), np.where(hole, 0.0, 1.0)
    shown = {at: [] for at in map(tuple, np.argwhere(hole))}

    def is_one(one, other):
        return abs(disparity[one] - disparity[other]) <= one_surface

    def unlike(patch, middle, place):
        there = [(v - middle[0] + place[0], u - middle[1] + place[1]) for v, u in patch]
        is_known = [not hole[b] and is_one(a, b) for a, b in zip(patch, there)]
        steps = [((colors[b] - colors[a]) ** 2).sum() if k else MISSING for a, b, k in zip(patch, there, is_known)]
        return np.array(steps)

    def best_place(patch, middle, places):
        weights = np.array([1.0 if trust[at] > 0 else GUESS for at in patch])
        fits = [at for at in places if all(RADIUS_PX <= part < side - RADIUS_PX for part, side in zip(at, size))]
        inside = [at for at in fits if not hole[at] and is_one(at, middle)]
        return min(inside, key=lambda place: (unlike(patch, middle, place) * weights).sum(), default=None)

    def fill(middle):
        patch = [at for at in window(size, *middle, RADIUS_PX) if is_one(at, middle)]
        reach = range(-SEARCH_PX, SEARCH_PX + 1, STEP_PX)
        coarse = best_place(patch, middle, [(middle[0] + j, middle[1] + i) for j, i in product(reach, reach)])
        if coarse is None:
            return False
        fine = range(-STEP_PX + 1, STEP_PX)
        place = best_place(patch, middle, [coarse] + [(coarse[0] + j, coarse[1] + i) for j, i in product(fine, fine)])
        known = [trust[at] > 0 for at in patch]
        misfit = unlike(patch, middle, place)[known].mean()
        trusted = max(np.mean([trust[at] for at in patch if trust[at] > 0]) * np.exp(-misfit / FIT**2), MIN_TRUST)
        for at in patch:
            source = at[0] - middle[0] + place[0], at[1] - middle[1] + place[1]
            if hole[at] and not hole[source] and is_one(at, source):
                shown[at] += [colors[source].copy()] * (int(FIRST_PATCH_WEIGHT) if trust[at] == 0 else 1)
                if trust[at] == 0:
                    colors[at], trust[at] = colors[source], trusted
        return True

    blocks = sorted({(y // PATCH_BLOCK_PX, x // PATCH_BLOCK_PX) for y, x in np.argwhere(hole)})
    for odd in ((0, 0), (1, 1), (0, 1), (1, 0)):
        for block in (each for each in blocks if (each[0] % 2, each[1] % 2) == odd):
            own = [at for at in map(tuple, np.argwhere(hole)) if np.array_equal(np.array(at) // PATCH_BLOCK_PX, block)]
            queue = [at for at in own if any(trust[b] > 0 and is_one(at, b) for b in steps_beside(size, *at))]
            for middle in queue:
                if trust[middle] == 0 and fill(middle):
                    around = window(size, *middle, RADIUS_PX + 1)
                    queue += [
                        at for at in around if at in own and trust[at] == 0 and is_one(at, middle) and at not in queue
                    ]
    change, blended = np.zeros_like(smooth, np.float64), smooth.copy()
    for at, patches in shown.items():
        change[at] = np.mean(patches, axis=0) - smooth[at] if patches else 0
    for at in map(tuple, np.argwhere(hole)):
        fine = change[at] - np.mean([change[b] for b in window(size, *at, FINE_TEXTURE_PX) if hole[b]], axis=0)
        fine *= MAX_TEXTURE / max(np.abs(fine).max(), MAX_TEXTURE)
        blended[at] = np.maximum(smooth[at] + trust[at] * change[at] + (1 - trust[at]) * fine, 0)
    return blended


def copied(smooth, disparity, hole, threads=2):
    colors, number = smooth.copy(), np.empty(hole.shape, np.int32)
    pixels = np.flatnonzero(hole)
    number_pixels(pixels, number)
    copy_patches(colors, disparity, hole, pixels, number, ONE_SURFACE, threads)
    return colors


def test_agrees_with_a_slow_twin_across_blocks():
    random = np.random.default_rng(3)
    size = (PATCH_BLOCK_PX + 6, PATCH_BLOCK_PX + 20)
    y, x = np.indices(size)
    disparity = np.where(x + y < 70, 0.0, 2.0).astype(np.float32)
    colors = (0.5 + 0.3 * np.sin(x / 3)[..., None] + random.normal(0, 0.04, (*size, 3))).astype(np.float32)
    hole = (abs(x - PATCH_BLOCK_PX) < 4) & (y > 57) | (random.random(size) < 0.004)
    expected = copy_slowly(colors, disparity, hole, ONE_SURFACE)
    assert np.abs(expected - colors)[hole].max() > 0.1
    assert copied(colors, disparity, hole) == pytest.approx(expected, abs=1e-4)


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
    fill_background(colors, disparity, np.ones_like(hole), photo_disparity, offset)
    assert np.isfinite([*colors.flat, *disparity.flat]).all(), "where nothing is known, too"


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
