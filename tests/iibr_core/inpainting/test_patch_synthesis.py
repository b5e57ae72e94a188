from itertools import product

import numpy as np
import pytest

from iibr_core.inpainting.nearest_known import number_pixels
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
from iibr_core.runtime.work import Cancelled, stoppable

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
        """Return for each of its pixels, from those around another place."""
        there = [(v - middle[0] + place[0], u - middle[1] + place[1]) for v, u in patch]
        return np.array(
            [
                ((colors[b] - colors[a]) ** 2).sum() if not hole[b] and is_one(a, b) else MISSING
                for a, b in zip(patch, there)
            ]
        )

    def best_place(patch, middle, places):
        weights = np.array([1.0 if trust[at] > 0 else GUESS for at in patch])
        inside = [
            (v, u)
            for v, u in places
            if RADIUS_PX <= v < size[0] - RADIUS_PX and RADIUS_PX <= u < size[1] - RADIUS_PX
            if not hole[v, u] and is_one((v, u), middle)
        ]
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
            own = [
                at
                for at in map(tuple, np.argwhere(hole))
                if (at[0] // PATCH_BLOCK_PX, at[1] // PATCH_BLOCK_PX) == block
            ]
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
    hole = (abs(x - PATCH_BLOCK_PX) < 4) & (y > 50) | (random.random(size) < 0.004)
    expected = copy_slowly(colors, disparity, hole, ONE_SURFACE)
    assert np.abs(expected - colors)[hole].max() > 0.1
    assert copied(colors, disparity, hole) == pytest.approx(expected, abs=1e-4)


def test_stays_as_it_is_where_nothing_is_known_and_can_be_cancelled():
    colors, disparity = np.full((20, 30, 3), 0.3, np.float32), np.zeros((20, 30), np.float32)
    everywhere = np.ones((20, 30), np.bool_)
    np.testing.assert_array_equal(copied(colors, disparity, everywhere), colors)
    with pytest.raises(Cancelled), stoppable(lambda: True):
        copied(colors, disparity, everywhere)
