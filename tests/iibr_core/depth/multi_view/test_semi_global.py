"""Semi-global matching against its paper's equation, path by path."""

from itertools import product

import numpy as np

from iibr_core.depth.multi_view.semi_global import EDGE_LUMA, JUMP_COST, STEP_COST, choose_disparity


def slow_sums(costs, luma):
    """Return the sums of all paths (equation 13), rounded as they are stored."""
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
                jump = max(STEP_COST, JUMP_COST * np.exp(-abs(luma[y, x] - luma[v, u]) / EDGE_LUMA))
                for d in range(count):
                    beside = [paths[v, u, e] + STEP_COST for e in (d - 1, d + 1) if 0 <= e < count]
                    paths[y, x, d] += min(paths[v, u, d], *beside, lowest + jump) - lowest
        sums += np.floor(paths + 0.5)
    return sums


def test_one_disparity_leaves_no_choice():
    values, _ = choose_disparity(np.full((3, 4, 1), 7, np.uint8), np.zeros((3, 4), np.float32), np.float32([1.5]))
    assert (values == 1.5).all()


def test_disparities_are_the_cheapest_of_all_paths_and_lie_between_steps():
    rng = np.random.default_rng(4)
    costs = rng.integers(0, 256, (7, 9, 6)).astype(np.uint8)
    luma = (0.1 * rng.random((7, 9))).astype(np.float32)
    disparities = np.linspace(-1.0, 1.5, 6).astype(np.float32)
    values, sureness = choose_disparity(costs, luma, disparities)
    sums = slow_sums(costs.astype(float), luma.astype(float))
    inner = 0
    for y, x in np.ndindex(7, 9):
        best = int(np.argmin(sums[y, x]))
        expected = disparities[best]
        if 0 < best < 5:
            below, least, above = sums[y, x, best - 1 : best + 2]
            # The lowest point of the parabola through three sums.
            a, b, _ = np.polyfit([-1, 0, 1], [below, least, above], 2)
            expected, inner = expected - 0.5 * b / (2 * a) if a > 0 else expected, inner + 1
        # A sum that float32 rounds the other way is one of hundreds.
        assert abs(values[y, x] - expected) < 0.02
        mean = costs[y, x].mean()
        assert abs(sureness[y, x] - max(mean - costs[y, x, best], 0) / max(mean, 1)) < 1e-5
    assert inner > 20
