"""Costs of disparities against slow and plain definitions."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from iibr_core.depth.guided_filter import GuidedFilter
from iibr_core.depth.multi_view.matching import HIDDEN_FACTOR, MAX_DIFFERENCE, MIN_SEEN_SHARE, _match, _store_costs
from tests.iibr_core.scenes import smooth_texture


def test_the_guided_filter_follows_its_paper():
    """Slow twin: every window's line fitted by itself, then the means of all windows about a pixel."""
    guide, image = smooth_texture(9, 11)[..., 0].copy(), smooth_texture(9, 11, 4)[..., 1].copy()
    radius, smoothness = 2, 1e-3
    slopes, bases = np.empty_like(guide), np.empty_like(guide)

    def window(values, y, x):
        return values[max(y - radius, 0) : y + radius + 1, max(x - radius, 0) : x + radius + 1].astype(np.float64)

    for y, x in np.ndindex(*guide.shape):
        g, p = window(guide, y, x), window(image, y, x)
        slopes[y, x] = (np.mean(g * p) - g.mean() * p.mean()) / (g.var() + smoothness)
        bases[y, x] = p.mean() - slopes[y, x] * g.mean()
    expected = [window(slopes, *at).mean() * guide[at] + window(bases, *at).mean() for at in np.ndindex(*guide.shape)]
    filtered = np.stack([image, guide])
    GuidedFilter(guide, radius, smoothness).apply(filtered)
    np.testing.assert_allclose(filtered[0].ravel(), expected, atol=2e-4)


@pytest.mark.parametrize("disparity", [0.0, 0.4, -1.25, 3.0])
def test_matching_equals_its_slow_twin(disparity):
    """Every pixel by itself: its place in each view, the four pixels around that, the mean of each side's views."""
    rng = np.random.default_rng(1)
    textures = rng.normal(0, 0.02, (9, 7, 8)).astype(np.float32)
    offsets = np.float32([(0, 0), (0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, -1), (1, -1), (-2, 2)])
    found = np.empty((5, 7, 8), np.float32)
    _match(textures, offsets, np.float32(disparity), found)
    for y, x in np.ndindex(7, 8):
        costs = []
        for texture, (t, s) in zip(textures[1:], offsets[1:]):
            row, column = y - disparity * t, x - disparity * s
            if 0 <= row <= 6 and 0 <= column <= 7:
                value = map_coordinates(texture.astype(np.float64), [[row], [column]], order=1)[0]
                costs.append((t, s, min((value - textures[0, y, x]) ** 2, MAX_DIFFERENCE**2)))
        is_seen = len(costs) >= MIN_SEEN_SHARE * 8
        everything = np.mean([cost for *_, cost in costs]) if is_seen else MAX_DIFFERENCE**2
        sides = (lambda t, s: s < 0, lambda t, s: s > 0, lambda t, s: t < 0, lambda t, s: t > 0)
        halves = [[cost for t, s, cost in costs if is_there(t, s)] for is_there in sides]
        expected = [np.mean(half) if half and is_seen else everything for half in halves]
        np.testing.assert_allclose(found[:, y, x], [*expected, everything], rtol=1e-4, atol=1e-8)


def test_views_are_hidden_where_the_other_half_matches_much_better():
    parts = (1e-3 * np.random.default_rng(3).random((5, 6, 8))).astype(np.float32)
    parts[4] = parts[:4].mean(axis=0)
    found = np.empty((6, 8), np.uint8)
    _store_costs(parts, found)
    cost = np.minimum(parts[4], HIDDEN_FACTOR * parts[:4].min(axis=0))
    assert (cost < parts[4]).any()
    np.testing.assert_allclose(found, 255 * np.minimum(np.sqrt(cost) / MAX_DIFFERENCE, 1), atol=1.01)
