"""Fronts that grow over their soft outlines, against a slow, obvious twin; and what must stay as it is."""

import numpy as np
import pytest

from iibr_core.depth.edges import soft_outlines
from iibr_core.depth.edges.rim_sides import step_distance
from iibr_core.depth.edges.soft_outlines import (
    FRONT_PX,
    GAP_PX,
    LEAST_LENGTH_PX,
    MOST_BEYOND,
    REACH_PX,
    SOFT_PX,
    STRIDE_PX,
    widen_fronts,
)
from iibr_core.runtime.jit import nearest_pixel
from iibr_core.runtime.tiling import Cancelled, never

STEP, NEAR, FAR = 0.3, 4.0, 1.0
SIZE = (64, 60)


def soft_front(width_px, seed=0):
    """A dark front to the left of column 30 before a bright wall, out of focus: shares (H, W), photo, map."""
    rng = np.random.default_rng(seed)
    x = np.broadcast_to(np.arange(SIZE[1]), SIZE)
    share = np.clip(0.5 - (x - 29.5) / max(width_px, 1e-3), 0, 1)
    photo = share[..., None] * np.array([0.2, 0.15, 0.1]) + (1 - share[..., None]) * np.array([0.7, 0.75, 0.8])
    photo += rng.normal(0, 0.005, photo.shape)
    return share, photo.astype(np.float32), np.where(x < 30, NEAR, FAR).astype(np.float32)


def around(y, x, reach, stride=1):
    ys, xs = (range(max(at - reach, 0), min(at + reach + 1, end), stride) for at, end in zip((y, x), SIZE, strict=True))
    return [(v, u) for v in ys for u in xs]


def slow_front(values, y, x):
    fronts = [p for p in around(y, x, SOFT_PX + 1) if values[p] - values[y, x] > STEP]
    return min(fronts, key=lambda p: (p[0] - y) ** 2 + (p[1] - x) ** 2, default=None)


def slow_share(colors, values, distance, y, x, front):
    half = 0.5 * (front - values[y, x])
    samples = around(y, x, REACH_PX, STRIDE_PX)
    back = [colors[p] for p in samples if distance[p] > SOFT_PX and abs(values[p] - values[y, x]) <= half]
    fore = [colors[p] for p in samples if distance[p] > FRONT_PX and abs(values[p] - front) <= half]
    if min(len(back), len(fore)) < soft_outlines.LEAST_SAMPLES:
        return 0.0
    way = np.mean(fore, axis=0, dtype=np.float64) - np.mean(back, axis=0, dtype=np.float64)
    length = np.linalg.norm(way)
    off = colors[y, x] - np.mean(back, axis=0, dtype=np.float64)
    along = off @ way / length
    is_mixed = (
        length > soft_outlines.LEAST_CONTRAST
        and soft_outlines.LEAST_SHARE * length < along < soft_outlines.MOST_SHARE * length
        and np.linalg.norm(off - along * way / length) < soft_outlines.MOST_ASIDE * length
        and along > soft_outlines.DEVIATIONS * np.std(np.array(back, np.float64) @ way / length)
    )
    return along / length if is_mixed else 0.0


def slow_ends_clean(values, shares, y, x):
    if slow_front(values, y, x) is None:
        return False
    front = np.array(slow_front(values, y, x))
    off = np.array([y, x]) - front
    for k in (SOFT_PX - 1, SOFT_PX):
        v, u = (front[i] + nearest_pixel(off[i] * k / abs(off).max()) for i in range(2))
        if not (0 <= v < SIZE[0] and 0 <= u < SIZE[1]) or shares[v, u] > 0:
            return False
    return True


def slow_find_mixed(colors, values):
    distance, shares = step_distance(values, STEP, SOFT_PX), np.zeros(SIZE)
    beside = {p: max(values[q] for q in around(*p, 1)) for p in np.ndindex(SIZE)}
    ring = {p: front for p, front in beside.items() if front - values[p] > STEP}
    fronts = dict(ring)
    for _ in range(SOFT_PX):
        for p, front in ring.items():
            shares[p] = slow_share(colors, values, distance, *p, front)
        ring = {
            q: fronts[p] for p in ring for q in around(*p, 1)
            if shares[p] > 0 and distance[q] <= SOFT_PX and q not in fronts and abs(values[q] - values[p]) <= STEP
        }  # fmt: skip
        fronts |= ring
    return shares


def slow_fades(shares, beyond):
    """Those, of which the shares just beyond them are known, that belong to an outline which fades."""
    left, outlines = set(beyond), set()
    while left:
        together, new = set(), {left.pop()}
        while new:
            together, new = together | new, {q for p in new for q in around(*p, GAP_PX) if q in left}
            left -= new
        own, beside = (np.mean([of[p] for p in together]) for of in (shares, beyond))
        if len(together) >= LEAST_LENGTH_PX and beside < min(own, MOST_BEYOND):
            outlines |= together
    return outlines


def slow_grown(values, mixed):
    """The disparity in front of mixed pixels beside an edge, and the mixed pixels just beyond them."""
    in_front = {p: max(values[q] for q in around(*p, 1)) for p in mixed}
    touching = {p for p in mixed if in_front[p] - values[p] > STEP}
    beyond = {
        p: [q for q in around(*p, 1) if q in mixed - touching and abs(values[q] - values[p]) <= STEP] for p in touching
    }
    return {p: (in_front[p], others) for p, others in beyond.items() if others}


def slow_widen(colors, values):
    shares = slow_find_mixed(colors, values)
    mixed = {(y, x) for y, x in np.argwhere(shares).tolist() if slow_ends_clean(values, shares, y, x)}
    first = slow_grown(values, mixed)
    mixed -= first.keys() - slow_fades(shares, {p: np.mean([shares[q] for q in qs]) for p, (_, qs) in first.items()})
    widened = values.copy()
    for _ in range(SOFT_PX):
        grown = slow_grown(widened, mixed)
        for p, (front, _) in grown.items():
            widened[p] = front
        mixed -= grown.keys()
    one_more = widened.copy()
    for p in map(tuple, np.argwhere(widened != values).tolist()):
        for q in around(*p, 1):
            if widened[p] - widened[q] > STEP:
                one_more[q] = max(widened[r] for r in around(*q, 1))
    return one_more


def test_fronts_grow_as_the_slow_ones_do():
    _, photo, values = soft_front(9)
    rng = np.random.default_rng(1)
    photo[rng.random(SIZE) < 0.02] = 0.3
    values[10:16, 28:30] = FAR
    values[20:24, 30:33] = NEAR
    widened = widen_fronts(photo, values, STEP, never)
    assert (widened != values).sum() > 30
    np.testing.assert_array_equal(widened, slow_widen(photo, values))


@pytest.mark.parametrize("way", [(0, 1), (0, -1), (1, 0), (-1, 0)])
def test_the_front_is_the_nearest_pixel_that_stands_before_and_not_too_far(way):
    for away in range(1, SOFT_PX + 4):
        values = np.zeros((30, 30), np.float32)
        place = 15 + away * way[0], 15 + away * way[1]
        values[place] = 5.0
        assert soft_outlines._nearest_front(values, 15, 15, 1.0) == (place if away <= SOFT_PX + 1 else (15, 15))
        values[15 - way[0], 15 - way[1]] = 0.9
        values[15 - 2 * way[0], 15 - 2 * way[1]] = 1.1
        if away != 2:
            nearest = place if away < 2 else (15 - 2 * way[0], 15 - 2 * way[1])
            assert soft_outlines._nearest_front(values, 15, 15, 1.0) == nearest


def test_a_surface_that_rises_to_its_front_beside_an_edge_has_no_outline_there():
    _, photo, values = soft_front(8)
    values[:], values[:, :30], values[:, 30] = FAR + 0.9 * STEP, FAR + 1.2 * STEP, FAR
    values[:, 36:42] = FAR + 0.5 * STEP
    np.testing.assert_array_equal(widen_fronts(photo, values, STEP, never), slow_widen(photo, values))


def test_a_front_out_of_focus_takes_its_outline_along():
    share, photo, values = soft_front(8)
    widened = widen_fronts(photo, values, STEP, never)[SOFT_PX:-SOFT_PX]
    assert (widened[share[SOFT_PX:-SOFT_PX] > soft_outlines.LEAST_SHARE] == NEAR).all()
    assert (widened[share[SOFT_PX:-SOFT_PX] == 0] == FAR).all()


def test_what_does_not_fade_is_the_edge_of_something_else():
    """A dark stripe along the front, three pixels wide."""
    _, photo, values = soft_front(1)
    photo[:, 30:33] = photo[:, :1]
    assert widen_fronts(photo, values, STEP, never) is values


@pytest.mark.parametrize("length_px", [18, 32])
def test_what_is_soft_for_a_few_pixels_only_is_the_edge_of_something_else(length_px):
    _, photo, values = soft_front(8)
    photo[: SIZE[0] - length_px] = soft_front(1)[1][: SIZE[0] - length_px]
    widened = widen_fronts(photo, values, STEP, never)
    assert (widened is not values) == (length_px == 32)


@pytest.mark.parametrize(("contrast", "is_told"), [(0.07, False), (0.14, True)])
def test_fronts_of_nearly_the_colour_of_their_back_stay(contrast, is_told):
    _, photo, values = soft_front(8)
    faint = photo[:, -1:].mean(axis=0) + contrast / np.sqrt(1.1) * (photo - photo[:, -1:].mean(axis=0))
    assert (widen_fronts(faint.astype(np.float32), values, STEP, never) is not values) == is_told


def test_single_mixed_pixels_are_left_to_matting():
    _, photo, values = soft_front(2)
    assert widen_fronts(photo, values, STEP, never) is values


def test_what_looks_like_the_front_but_goes_on_is_the_backs_own():
    """A dark stripe that runs away from the edge, and one along it that is wider than outlines are."""
    _, photo, values = soft_front(1)
    photo[12:16, 30:] = photo[12:16, :1]
    np.testing.assert_array_equal(widen_fronts(photo, values, STEP, never), values)
    photo[:, 30 : 30 + SOFT_PX + 2] = photo[:, :1]
    np.testing.assert_array_equal(widen_fronts(photo, values, STEP, never), values)


def test_a_stop_is_heard():
    _, photo, values = soft_front(8)
    with pytest.raises(Cancelled):
        widen_fronts(photo, values, STEP, lambda: True)
