"""Sides of rims against a slow, obvious twin of the random field, and what it must leave alone."""

import numpy as np
import pytest

from iibr_core.depth.edges import rim_sides
from iibr_core.depth.edges.rim_sides import choose_sides
from iibr_core.runtime.tiling import Cancelled, never
from tests.iibr_core.scenes import smooth_texture

EDGE, NEAR, FAR = 0.3, 5.0, 1.0


def shifted_square(size=26):
    """A square before a wall, textures of different brightness; its map, one pixel beside it, with a few unknown."""
    rng = np.random.default_rng(3)
    truth = np.full((size, size), FAR, np.float32)
    truth[8:18, 8:18] = NEAR
    photo = 0.25 * smooth_texture(size, size) + np.where(truth == NEAR, 0.55, 0.1)[..., None].astype(np.float32)
    given = np.roll(truth, 1, axis=1)
    unknown = rng.random(truth.shape) < 0.03
    return photo + rng.normal(0, 0.01, photo.shape).astype(np.float32), given, unknown, truth


def around(values, y, x, reach):
    height, width = values.shape
    for v in range(max(y - reach, 0), min(y + reach + 1, height)):
        for u in range(max(x - reach, 0), min(x + reach + 1, width)):
            if (v, u) != (y, x):
                yield v, u


def slow_distance(values):
    height, width = values.shape
    steps = [((y, x), (y, x + 1)) for y in range(height) for x in range(width - 1)]
    steps += [((y, x), (y + 1, x)) for y in range(height - 1) for x in range(width)]
    beside = [p for pair in steps if abs(values[pair[0]] - values[pair[1]]) > EDGE for p in pair]
    away = [[min(max(abs(y - v), abs(x - u)) for v, u in beside) for x in range(width)] for y in range(height)]
    return np.minimum(away, rim_sides.RIM_PX + 1)


def slow_weigh(colors, values, unknown, distance, y, x, alike):
    own = float(values[y, x])
    others = [p for p in around(values, y, x, rim_sides.RIM_PX + 1) if abs(values[p] - own) > EDGE]
    if not others:
        return own, 0.0
    other = float(values[min(others, key=lambda p: (p[0] - y) ** 2 + (p[1] - x) ** 2)])
    weights, likes, disparity = [0.0, 0.0], [0.0, 0.0], 0.0
    for p in around(values, y, x, rim_sides.REACH_PX):
        apart = abs(values[p] - own), abs(values[p] - other)
        if min(apart) > 0.5 * abs(other - own):
            continue
        side = 0 if apart[0] <= apart[1] else 1
        w = np.exp(-((p[0] - y) ** 2 + (p[1] - x) ** 2) / (2 * rim_sides.SPREAD_PX**2))
        w *= rim_sides.TRUST[distance[p]] * (rim_sides.FILLED_TRUST if unknown[p] else 1)
        weights[side] += w
        likes[side] += w * np.exp(-np.sum((colors[p] - colors[y, x]) ** 2) / (2 * alike**2))
        disparity += side * w * values[p]
    if weights[1] <= rim_sides.LEAST_WEIGHT:
        return own, 0.0
    unseen, unlike = rim_sides.UNSEEN_WEIGHT, rim_sides.UNLIKE
    on = [(like + unseen * unlike) / (weight + unseen) + unlike for like, weight in zip(likes, weights, strict=True)]
    return disparity / weights[1], np.log(on[0] / on[1])


def slow_pass(colors, values, other, drive, alike, believed):
    belief = np.ones(values.shape)
    for y, x in np.argwhere(other != values):
        half = 0.5 * abs(other[y, x] - values[y, x])

        def says(d, y=y, x=x, half=half):
            return 1 if abs(d - values[y, x]) <= half else -1 if abs(d - other[y, x]) <= half else 0

        total = drive[y, x]
        for p in around(values, y, x, 1):
            like = np.exp(-np.sum((colors[p] - colors[y, x]) ** 2) / (2 * alike**2)) + rim_sides.UNLIKE_NEIGHBOUR
            straight = 1 if p[0] == y or p[1] == x else rim_sides.DIAGONAL
            votes = believed[p] * says(values[p]) + (1 - believed[p]) * says(other[p])
            total += rim_sides.COHESION * straight * like * votes
        belief[y, x] = 1 / (1 + np.exp(-np.clip(total, -30, 30)))
    return belief


def slow_sides(colors, values, unknown):
    reluctance, only_tall = None, False
    for _ in range(rim_sides.ROUNDS):
        distance = slow_distance(values)
        rim = distance <= rim_sides.RIM_PX
        contrast = rim_sides._mean_color_step(colors, np.flatnonzero(rim))
        other, drive = values.astype(np.float64), np.zeros(values.shape)
        for y, x in np.argwhere(rim):
            weighed = slow_weigh(colors, values, unknown, distance, y, x, rim_sides.ALIKE * contrast)
            other[y, x], drive[y, x] = weighed
        if reluctance is None:
            counted = rim & ~unknown
            shares = rim_sides._contradicted(drive[counted], distance[counted])
            if shares[1] > rim_sides.MOST_MISLED * shares[0]:
                only_tall = True
                counted &= np.abs(other - values) > rim_sides.TALL_EDGES * EDGE
                shares = rim_sides._contradicted(drive[counted], distance[counted])
                assert shares[1] <= rim_sides.MOST_MISLED * shares[0]
            reluctance = (rim_sides.RELUCTANCE * np.log((1 - shares) / shares)).astype(np.float32)
        drive[rim] += np.where(unknown[rim], 0, reluctance[distance[rim]])
        if only_tall:
            drive[np.abs(other - values) <= rim_sides.TALL_EDGES * EDGE] = np.inf
        belief = np.ones(values.shape)
        for _ in range(rim_sides.PASSES):
            belief = slow_pass(colors, values, other, drive, rim_sides.LIKE_NEIGHBOUR * contrast, belief)
        values = np.where(belief < 0.5, other, values).astype(np.float32)
    return values


def test_sides_are_those_of_the_slow_field_and_of_the_truth():
    photo, given, unknown, truth = shifted_square()
    chosen = choose_sides(photo, given, unknown, EDGE, never)
    np.testing.assert_allclose(chosen, slow_sides(photo, given, unknown), atol=1e-4)
    assert (np.abs(given - truth) > 1).sum() == 20
    assert (np.abs(chosen - truth) > 1).sum() <= 2


def test_a_pass_of_the_field_is_the_slow_one():
    """Beliefs, sides and drives at random: every neighbour's vote counts, for whichever surface, straight or not."""
    photo, given, _, _ = shifted_square()
    rng = np.random.default_rng(7)
    values = rng.choice(np.float32([FAR, 3.0, NEAR]), given.shape)
    other = np.where(rng.random(given.shape) < 0.6, rng.choice(np.float32([FAR, 3.0, NEAR]), given.shape), values)
    drive, believed = rng.normal(0, 1, given.shape), rng.random(given.shape)
    pixels = np.flatnonzero(other != values)
    believed = np.where(other != values, believed, 1)
    number = np.full(given.shape, -1, np.int32)
    number.ravel()[pixels] = np.arange(len(pixels))
    belief = np.empty(len(pixels), np.float32)
    others, drives, beliefs = (np.float32(each.ravel()[pixels]) for each in (other, drive, believed))
    rim_sides._believe(photo, values, pixels, number, others, drives, 0.2, beliefs, belief, 0)
    expected = slow_pass(photo, values, other, drive, 0.2, believed)
    np.testing.assert_allclose(belief, expected.ravel()[pixels], atol=1e-5)


def test_an_outline_costs_as_much_along_rows_as_along_diagonals():
    """A pixel of a straight one cuts one straight pair of neighbours and two diagonal ones; a step of a slanted one is
    longer and cuts two of each.
    """
    straight, slanted = 1 + 2 * rim_sides.DIAGONAL, (2 + 2 * rim_sides.DIAGONAL) / np.sqrt(2)
    assert straight == pytest.approx(slanted, rel=0.01)


def test_colours_that_contradict_the_map_inside_surfaces_change_nothing():
    photo, _, unknown, truth = shifted_square()
    shaded = np.roll(np.roll(photo, 3, axis=1), 3, axis=0)
    np.testing.assert_array_equal(choose_sides(shaded, truth, unknown, EDGE, never), truth)


def test_outlines_are_mended_beside_low_steps_that_the_photo_contradicts():
    """Patches of a noisy map, a little nearer than the wall, and shades that are elsewhere."""
    photo, given, unknown, truth = (np.tile(a, (1, 2, 1)[: a.ndim]) for a in shifted_square())
    given[:, 26:], truth[:, 26:] = FAR, FAR
    given[6:20, 32:46] = truth[6:20, 32:46] = FAR + 2 * EDGE
    photo[:, 26:] = np.roll(photo[:, 26:], 2, axis=0)
    chosen = choose_sides(photo, given, unknown, EDGE, never)
    assert (np.abs(chosen - truth) > 1).sum() <= 2
    np.testing.assert_array_equal(chosen[:, 29:], given[:, 29:])
    np.testing.assert_allclose(chosen, slow_sides(photo, given, unknown), atol=1e-4)


def test_a_map_without_steps_stays_as_it_is():
    photo, given, unknown, _ = shifted_square()
    flat = np.ones_like(given)
    assert choose_sides(photo, flat, unknown, EDGE, never) is flat


def test_a_stop_is_heard():
    photo, given, unknown, _ = shifted_square()
    with pytest.raises(Cancelled):
        choose_sides(photo, given, unknown, EDGE, lambda: True)
