import numpy as np
import pytest
from scipy import ndimage

from iibr_core.depth.edges import labels
from iibr_core.depth.edges.labels import BAND_PX, NEIGHBOUR_WEIGHT, label_edges
from tests.iibr_core.scenes import smooth_texture

EDGE, NEAR, FAR = 0.3, 5.0, 1.0


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
    return np.minimum(away, BAND_PX + 1)


def slow_mixed(color, colors, weights, behind, alike):
    """colors, weights: two lists each, of its own surface and the other; behind: which of both is the background."""
    background, foreground = (np.average(colors[side], axis=0, weights=weights[side]) for side in (behind, 1 - behind))
    way = foreground - background
    share = (color - background) @ way / (way @ way)
    spread = np.average(np.sum((np.array(colors[behind]) - background) ** 2, axis=1), weights=weights[behind])
    if not np.sqrt(spread / (way @ way)) < share < 1:
        return 0.0
    aside = np.sum((color - background - share * way) ** 2)
    return np.exp(-aside / (2 * alike**2)) * min(np.sqrt(2 * np.pi) * alike / np.linalg.norm(way), 1)


def slow_weigh(colors, values, distance, y, x, alike):
    own = float(values[y, x])
    others = [p for p in around(values, y, x, BAND_PX + 1) if abs(values[p] - own) > EDGE]
    if not others:
        return own, 0.0
    other = float(values[min(others, key=lambda p: (p[0] - y) ** 2 + (p[1] - x) ** 2)])
    weights, seen, likes = ([], []), ([], []), [0.0, 0.0]
    for p in around(values, y, x, labels.SAMPLED_PX):
        apart = abs(values[p] - own), abs(values[p] - other)
        if (p[0] - y) % 2 or (p[1] - x) % 2 or min(apart) > 0.5 * abs(other - own):
            continue
        side = 0 if apart[0] <= apart[1] else 1
        w = np.exp(-((p[0] - y) ** 2 + (p[1] - x) ** 2) / (2 * (labels.SAMPLED_PX / 2) ** 2))
        w *= labels.SAMPLE_WEIGHTS[distance[p]]
        weights[side].append(w)
        seen[side].append(colors[p].astype(np.float64))
        likes[side] += w * np.exp(-np.sum((colors[p] - colors[y, x]) ** 2) / (2 * alike**2))
    if sum(weights[1]) <= 0:
        return own, 0.0
    if own > other and sum(weights[0]) < labels.MIN_FOREGROUND:
        return own, 0.0
    unseen, unlike, behind = labels.UNSEEN_WEIGHT, labels.UNLIKELY, 0 if other > own else 1
    on = [(like + unseen * unlike) / (sum(weight) + unseen) for like, weight in zip(likes, weights, strict=True)]
    if weights[0]:
        on[1 - behind] = max(on[1 - behind], slow_mixed(colors[y, x], seen, weights, behind, alike))
    return other, np.log((on[0] + unlike) / (on[1] + unlike))


def slow_pass(colors, values, other, drive, alike, believed):
    belief = np.ones(values.shape)
    for y, x in np.argwhere(other != values):
        half = 0.5 * abs(other[y, x] - values[y, x])

        def says(d, y=y, x=x, half=half):
            return 1 if abs(d - values[y, x]) <= half else -1 if abs(d - other[y, x]) <= half else 0

        total = drive[y, x]
        for p in around(values, y, x, 1):
            like = np.exp(-np.sum((colors[p] - colors[y, x]) ** 2) / (2 * alike**2))
            votes = believed[p] * says(values[p]) + (1 - believed[p]) * says(other[p])
            total += NEIGHBOUR_WEIGHT * like * votes
        belief[y, x] = 1 / (1 + np.exp(-np.clip(total, -30, 30)))
    return belief


def slow_errors(evidence, side, distance, known):
    """By (in front?, distance)."""

    def contradicted(*where, expected=0.05):
        clear = evidence[np.logical_and.reduce([known, np.abs(evidence) > NEIGHBOUR_WEIGHT, *where])]
        return ((clear < 0).sum() + 20 * expected) / (len(clear) + 20)

    wrong, far = {}, BAND_PX
    for s in (0, 1):
        misled = contradicted(side == s, distance == far)
        for k in range(far + 1):
            chance = max(misled, labels.MIXED_SHARES[s] if k == 0 else 0)
            share = contradicted(side == s, distance == k, expected=misled)
            here = known & (side == s) & (distance == k)
            is_told = here.any() and (np.abs(evidence[here]) > NEIGHBOUR_WEIGHT).mean() >= labels.MIN_CLEAR_SHARE
            share = share - chance if is_told and misled <= labels.MIN_CLEAR_SHARE * share else 0
            share /= max(1 - misled - chance, 0.1)
            wrong[s, k] = np.clip(share, labels.UNLIKELY, 1 - labels.UNLIKELY)
    return wrong


def slow_labels(colors, values, unknown):
    distance = slow_distance(values)
    band = distance <= BAND_PX
    alike = labels.LIKENESS * labels._mean_color_step(colors, np.flatnonzero(band))
    other, evidence = values.astype(np.float64), np.zeros(values.shape)
    for y, x in np.argwhere(band):
        other[y, x], evidence[y, x] = slow_weigh(colors, values, distance, y, x, alike)
    side = (values > other).astype(int)
    wrong = slow_errors(evidence, side, distance, ~unknown & band)
    odds = {at: NEIGHBOUR_WEIGHT * np.log((1 - share) / share) for at, share in wrong.items()}
    drive = np.full(values.shape, np.inf)
    for p in map(tuple, np.argwhere(band & (other != values))):
        drive[p] = evidence[p] + (0 if unknown[p] else odds[side[p], distance[p]])
    belief = np.ones(values.shape)
    for _ in range(labels.PASSES):
        belief = slow_pass(colors, values, other, drive, alike, belief)
    return np.where(belief < 0.5, other, values).astype(np.float32)


def test_labels_of_any_outline_are_those_of_the_slow_field():
    """Outlines up to the frame, textures like their difference: every pixel that tells colours counts somewhere."""
    rng = np.random.default_rng(2)
    truth = np.where(ndimage.gaussian_filter(rng.normal(size=(30, 24)), 3) > 0, NEAR, FAR).astype(np.float32)
    given = ndimage.minimum_filter(truth, 3)
    light = np.where(truth == NEAR, 0.35, 0.2)[..., None] + rng.normal(0, 0.03, (30, 24, 3))
    photo = (0.25 * smooth_texture(30, 24) + light).astype(np.float32)
    unknown = rng.random((30, 24)) < 0.05
    found = label_edges(photo, given, unknown, EDGE)
    np.testing.assert_allclose(found, slow_labels(photo, given, unknown), atol=1e-4)
    assert (found != given).sum() > 40


def square(size=60):
    """A square before a wall, textures of different brightness; its exact map and a dilated one."""
    truth = np.full((size, size), FAR, np.float32)
    truth[20:41, 20:41] = NEAR
    noise = np.random.default_rng(3).normal(0, 0.01, (size, size, 3))
    photo = 0.06 * smooth_texture(size, size) + np.where(truth == NEAR, 0.69, 0.125)[..., None] + 0.25 * noise
    return photo.astype(np.float32), truth, ndimage.maximum_filter(truth, 5)


def labelled(photo, given):
    return label_edges(photo, given, np.zeros(given.shape, np.bool_), EDGE)


@pytest.mark.parametrize("column", [50, 51])
def test_a_wire_of_a_dilated_map_stays_also_beside_its_place(column):
    photo, truth, _ = square()
    photo[:, column] = 0.1, 0.6, 0.1
    wire = truth.copy()
    wire[:, 50] = NEAR
    given = ndimage.maximum_filter(wire, 3) if column == 50 else np.maximum(ndimage.maximum_filter(truth, 3), wire)
    assert (labelled(photo, given)[:, 50] == NEAR).all()
