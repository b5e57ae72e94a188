from itertools import product

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from iibr_core.depth.guided_filter import GuidedFilter
from iibr_core.depth.multi_view.matching import (
    HIDDEN_DIFFERENCE,
    HIDDEN_FACTOR,
    MAX_TEXTURE_DIFFERENCE,
    MIN_SEEN_SHARE,
    _store_costs,
    match_at,
    view_groups,
)
from iibr_core.depth.multi_view.plain_areas import (
    LEAN_STEPS,
    MATCH_SHARE,
    MAX_LEAN,
    MIN_LIMIT,
    STRIPE_RATIO,
    _count_matches,
    lean_stripes,
)
from iibr_core.depth.multi_view.refinement import _apply, _diagonal, _measure, _smooth
from iibr_core.depth.multi_view.semi_global import EDGE_COLOR, JUMP_COST, STEP_COST, choose_disparity
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
    """Every pixel by itself: its place in each view, the four pixels around that, the mean of each group's views."""
    rng = np.random.default_rng(1)
    textures = rng.normal(0, 0.02, (9, 7, 8)).astype(np.float32)
    offsets = np.float32([(0, 0), (0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, -1), (1, -1), (-2, 2)])
    groups = view_groups(offsets)
    found = np.empty((len(groups), 7, 8), np.float32)
    match_at(textures, offsets, groups, np.float32(disparity), found)
    for y, x in np.ndindex(7, 8):
        costs = {}
        for view, (t, s) in enumerate(offsets[1:], 1):
            row, column = y - disparity * t, x - disparity * s
            if 0 <= row <= 6 and 0 <= column <= 7:
                value = map_coordinates(textures[view].astype(np.float64), [[row], [column]], order=1)[0]
                costs[view] = min((value - textures[0, y, x]) ** 2, MAX_TEXTURE_DIFFERENCE**2)
        is_seen = len(costs) >= MIN_SEEN_SHARE * 8
        everything = np.mean(list(costs.values())) if is_seen else MAX_TEXTURE_DIFFERENCE**2
        seen = [[costs[view] for view in np.flatnonzero(group) if view in costs] for group in groups]
        expected = [np.mean(part) if part and is_seen else everything for part in seen]
        np.testing.assert_allclose(found[:, y, x], expected, rtol=1e-4, atol=1e-8)


def test_groups_are_the_sides_and_lines_that_not_all_views_are_on():
    grid = np.float32(sorted(product((-2, -1, 0, 1, 2), repeat=2), key=lambda at: np.hypot(*at)))
    sizes = [group.sum() for group in view_groups(grid)]
    assert sizes == [10, 10, 10, 10, 4, 4, 4, 4, 24]
    assert [group.sum() for group in view_groups(np.float32([(0, 0), (0, 1), (0, -1)]))] == [1, 1, 2]
    assert view_groups(np.float32([(0, 0), (0, 1)])).tolist() == [[False, True]]


def test_views_are_hidden_where_the_other_half_matches_much_better():
    parts = (1e-3 * np.random.default_rng(3).random((5, 6, 8))).astype(np.float32)
    parts[:4, 0] = 0  # one half matches without any difference
    parts[4] = parts[:4].mean(axis=0) + 1e-4
    found = np.empty((6, 8), np.uint8)
    _store_costs(parts, found)
    cost = np.minimum(parts[4], np.maximum(HIDDEN_FACTOR * parts[:4].min(axis=0), HIDDEN_DIFFERENCE**2))
    assert (cost < parts[4]).any()
    np.testing.assert_allclose(found, 255 * np.minimum(np.sqrt(cost) / MAX_TEXTURE_DIFFERENCE, 1), atol=1.01)


def slow_sums(costs, colors, is_striped):
    """Return the sums of all paths (equation 13), with whole costs of jumps."""
    height, width, count = costs.shape
    sums = np.zeros(costs.shape)
    for down, across in (at for at in product((-1, 0, 1), repeat=2) if any(at)):
        paths = np.zeros(costs.shape)
        rows = range(height) if down >= 0 else range(height - 1, -1, -1)
        columns = range(width) if across >= 0 else range(width - 1, -1, -1)
        for y in rows:
            for x in columns:
                paths[y, x] = costs[y, x]
                v, u = y - down, x - across
                if not (0 <= v < height and 0 <= u < width):
                    continue
                lowest = paths[v, u].min()
                edge = 0 if is_striped[y, x] and is_striped[v, u] else np.abs(colors[y, x] - colors[v, u]).max()
                jump = np.floor(max(STEP_COST, JUMP_COST * np.exp(-edge / EDGE_COLOR)) + 0.5)
                for d in range(count):
                    beside = [paths[v, u, e] + STEP_COST for e in (d - 1, d + 1) if 0 <= e < count]
                    paths[y, x, d] += min(paths[v, u, d], *beside, lowest + jump) - lowest
        sums += paths
    return sums


def test_disparities_are_the_cheapest_of_all_paths_and_lie_between_steps():
    rng = np.random.default_rng(4)
    costs = rng.integers(0, 256, (7, 9, 6)).astype(np.uint8)
    colors = (0.06 * rng.random((7, 9, 3))).astype(np.float32)
    disparities = np.linspace(-1.0, 1.5, 6).astype(np.float32)
    is_striped = rng.random((7, 9)) < 0.4
    values, sureness = choose_disparity(costs, colors, disparities, is_striped)
    sums = slow_sums(costs.astype(float), colors.astype(float), is_striped)
    inner = 0
    for y, x in np.ndindex(7, 9):
        best = int(np.argmin(sums[y, x]))
        expected = disparities[best]
        if 0 < best < 5:
            below, least, above = sums[y, x, best - 1 : best + 2]
            # Two lines of one slope, the steeper one's, meet where both sides are equally far above them.
            slope = max(below, above) - least
            expected, inner = expected + 0.5 * (below - above) / (2 * slope) if slope > 0 else expected, inner + 1
        # A sum that float32 rounds the other way is one of hundreds.
        assert abs(values[y, x] - expected) < 0.02
        mean = costs[y, x].mean()
        assert abs(sureness[y, x] - max(mean - costs[y, x, best], 0) / max(mean, 1)) < 1e-5
    assert inner > 20


SIZE = 6, 7


def dense(curvature, across, down):
    """(N, N): curvature and the squares of weighted second differences along rows and columns."""
    matrix = np.diag(curvature.ravel().astype(float))
    number = np.arange(curvature.size).reshape(SIZE)
    for weights, numbers in ((across, number), (down.T, number.T)):
        for (y, x), weight in np.ndenumerate(weights):
            if 0 < x < weights.shape[1] - 1:
                row = np.zeros(curvature.size)
                row[numbers[y, x - 1 : x + 2]] = 1, -2, 1
                matrix += weight * np.outer(row, row)
    return matrix


def test_smoothing_solves_the_equations():
    parts = np.random.default_rng(2).random((3, *SIZE)).astype(np.float32)
    parts[1, :, [0, -1]] = parts[2, [0, -1]] = 0
    values, product = np.random.default_rng(1).normal(0, 1, SIZE).astype(np.float32), np.empty(SIZE, np.float32)
    _apply(values, *parts, product)
    np.testing.assert_allclose(product.ravel(), dense(*parts) @ values.ravel(), rtol=1e-4, atol=1e-5)
    np.testing.assert_allclose(_diagonal(*parts).ravel(), np.diag(dense(*parts)), rtol=1e-5)
    found = _smooth(np.zeros(SIZE, np.float32), values, *parts)
    expected = np.linalg.solve(dense(*parts), (parts[0] * values).ravel())
    np.testing.assert_allclose(found.ravel(), expected, atol=2e-3)


def test_curvature_and_pull_lead_to_the_disparity_at_which_views_agree():
    """Views of a texture that is linear: one step of Newton's is exact, however the views are placed."""
    y, x = np.mgrid[:12, :14].astype(np.float32)
    offsets = np.float32([(0, 0), (0, 1), (1, 0), (-1, 2), (1, 1)])
    truth, start = 0.3, np.full((12, 14), 0.25, np.float32)
    textures = np.stack([0.002 * (x + truth * s) - 0.001 * (y + truth * t) for t, s in offsets]).astype(np.float32)
    curvature, pull = np.empty((12, 14), np.float32), np.empty((12, 14), np.float32)
    _measure(textures, offsets, start, 0, 12, curvature, pull)
    inside = np.s_[2:-2, 2:-2]
    np.testing.assert_allclose(start[inside] - pull[inside] / curvature[inside], truth, atol=2e-3)


def test_stripes_are_pixels_with_parted_matches_and_lean_to_a_map():
    """Slow twins: counts by runs of low costs, leaning by the formula."""
    rng = np.random.default_rng(6)
    costs = rng.choice([2, 20, 60, 200, 255], (5, 6, 9)).astype(np.uint8)
    matches, limits = np.empty((5, 6), np.float32), np.empty((5, 6), np.uint8)
    _count_matches(costs, matches, limits)
    for y, x in np.ndindex(5, 6):
        values = costs[y, x].astype(float)
        seen = values[values < 255]
        low = max(MATCH_SHARE * seen.mean(), seen.min() + 2, MIN_LIMIT)
        marks = "".join("m" if value <= low else "-" if value > STRIPE_RATIO * low else "" for value in values)
        assert matches[y, x] == len([run for run in marks.split("-") if run])
        assert limits[y, x] == int(low)
    is_striped, near = rng.random((5, 6)) < 0.5, rng.uniform(-1, 3, (5, 6)).astype(np.float32)
    disparities, leaned = np.linspace(-1, 3, 9, dtype=np.float32), costs.copy()
    lean_stripes(leaned, is_striped, limits, disparities, near)
    lean = np.minimum(np.abs(disparities - near[..., None]) / 0.5 / LEAN_STEPS, MAX_LEAN)
    expected = np.minimum(np.maximum(costs, limits[..., None]) + lean, 255).astype(np.uint8)
    assert (np.abs(leaned.astype(int) - np.where(is_striped[..., None], expected, costs)) <= 1).all()
