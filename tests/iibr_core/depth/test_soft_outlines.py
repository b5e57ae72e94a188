"""Fronts that grow over their soft outlines, against a slow, obvious twin; and what must stay as it is."""

import numpy as np
import pytest

from iibr_core.depth import soft_outlines
from iibr_core.depth.rim_sides import step_distance
from iibr_core.depth.soft_outlines import (
    FRONT_PX,
    GAP_PX,
    LEAST_LENGTH_PX,
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


def slow_is_mixed(colors, values, distance, y, x, front):
    half = 0.5 * (front - values[y, x])
    samples = around(y, x, REACH_PX, STRIDE_PX)
    back = [colors[p] for p in samples if distance[p] > SOFT_PX and abs(values[p] - values[y, x]) <= half]
    fore = [colors[p] for p in samples if distance[p] > FRONT_PX and abs(values[p] - front) <= half]
    if min(len(back), len(fore)) < soft_outlines.LEAST_SAMPLES:
        return False
    way = np.mean(fore, axis=0, dtype=np.float64) - np.mean(back, axis=0, dtype=np.float64)
    length = np.linalg.norm(way)
    off = colors[y, x] - np.mean(back, axis=0, dtype=np.float64)
    along = off @ way / length
    return (
        length > soft_outlines.LEAST_CONTRAST
        and soft_outlines.LEAST_SHARE * length < along < soft_outlines.MOST_SHARE * length
        and np.linalg.norm(off - along * way / length) < soft_outlines.MOST_ASIDE * length
        and along > soft_outlines.DEVIATIONS * np.std(np.array(back, np.float64) @ way / length)
    )


def slow_ends_clean(values, mixed, y, x):
    front = np.array(slow_front(values, y, x))
    off = np.array([y, x]) - front
    for k in (SOFT_PX - 1, SOFT_PX):
        v, u = (front[i] + nearest_pixel(off[i] * k / abs(off).max()) for i in range(2))
        if not (0 <= v < SIZE[0] and 0 <= u < SIZE[1]) or mixed[v, u]:
            return False
    return True


def slow_find_mixed(colors, values):
    distance, mixed = step_distance(values, STEP, SOFT_PX), np.zeros(SIZE, bool)
    beside = {p: max(values[q] for q in around(*p, 1)) for p in np.ndindex(SIZE)}
    ring = {p: front for p, front in beside.items() if front - values[p] > STEP}
    fronts = dict(ring)
    for _ in range(SOFT_PX):
        for p, front in ring.items():
            mixed[p] = slow_is_mixed(colors, values, distance, *p, front)
        ring = {
            q: fronts[p] for p in ring for q in around(*p, 1)
            if mixed[p] and distance[q] <= SOFT_PX and q not in fronts and abs(values[q] - values[p]) <= STEP
        }  # fmt: skip
        fronts |= ring
    return mixed


def slow_goes_on(pixels):
    """Those that are at least LEAST_LENGTH_PX, each near another."""
    left, long = set(pixels), set()
    while left:
        together, new = set(), {left.pop()}
        while new:
            together, new = together | new, {q for p in new for q in around(*p, GAP_PX) if q in left}
            left -= new
        if len(together) >= LEAST_LENGTH_PX:
            long |= together
    return long


def slow_grown(values, mixed):
    in_front = {p: max(values[q] for q in around(*p, 1)) for p in mixed}
    touching = {p for p in mixed if in_front[p] - values[p] > STEP}
    return {
        p: in_front[p] for p in touching
        if any(q in mixed - touching and abs(values[q] - values[p]) <= STEP for q in around(*p, 1))
    }  # fmt: skip


def slow_widen(colors, values):
    mixed = slow_find_mixed(colors, values)
    mixed = {(y, x) for y, x in np.argwhere(mixed).tolist() if slow_ends_clean(values, mixed, y, x)}
    first = slow_grown(values, mixed)
    mixed -= first.keys() - slow_goes_on(first)
    for _ in range(SOFT_PX):
        values, grown = values.copy(), slow_grown(values, mixed)
        for p, front in grown.items():
            values[p] = front
        mixed -= grown.keys()
    return values


def test_fronts_grow_as_the_slow_ones_do():
    _, photo, values = soft_front(9)
    rng = np.random.default_rng(1)
    photo[rng.random(SIZE) < 0.02] = 0.3
    values[10:16, 28:30] = FAR
    values[20:24, 30:33] = NEAR
    widened = widen_fronts(photo, values, STEP, never)
    assert (widened != values).sum() > 30
    np.testing.assert_array_equal(widened, slow_widen(photo, values))


def test_a_front_out_of_focus_takes_its_outline_along():
    share, photo, values = soft_front(8)
    widened = widen_fronts(photo, values, STEP, never)[SOFT_PX:-SOFT_PX]
    assert (widened[share[SOFT_PX:-SOFT_PX] > 0.25] == NEAR).all()
    assert (widened[share[SOFT_PX:-SOFT_PX] == 0] == FAR).all()


@pytest.mark.parametrize("length_px", [14, 28])
def test_what_is_soft_for_a_few_pixels_only_is_the_edge_of_something_else(length_px):
    _, photo, values = soft_front(8)
    photo[: SIZE[0] - length_px] = soft_front(1)[1][: SIZE[0] - length_px]
    widened = widen_fronts(photo, values, STEP, never)
    assert (widened is not values) == (length_px == 28)


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
