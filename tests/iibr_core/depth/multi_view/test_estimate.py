import numpy as np
import pytest

from iibr_core.color import bytes_from_encoded
from iibr_core.depth.multi_view.all_views import estimate_all, matched_views, reconcile
from iibr_core.depth.multi_view.estimate import estimate_coarse, estimate_disparity, find_confirmed
from iibr_core.types import GridShape, InputError, ViewOffset

GRID = GridShape(5, 5)
OFFSETS = [GRID.offset(*at) for at in np.ndindex(*GRID)]
PAIR = [ViewOffset(0.0, 0.0), ViewOffset(0.0, 1.0)]


def find(views, offsets=OFFSETS):
    reference = offsets.index(ViewOffset(0.0, 0.0))
    return estimate_disparity(views, offsets, reference, estimate_coarse(views, offsets, reference).range_px)


def slanted_views(slope, offsets=OFFSETS, size=(80, 96)):
    """Views of a plane whose disparity grows by `slope` px a column, drawn exactly: a sum of sines. And its truth."""
    y, x = np.mgrid[: size[0], : size[1]].astype(np.float64)
    waves = np.random.default_rng(2).uniform(-1.2, 1.2, (24, 2))
    phases = np.random.default_rng(3).uniform(0, 6.28, 24)

    def view(offset):
        # A view's pixel at x shows what the centre view has at from_x, where from_x - d(from_x) s = x.
        from_x = (x - slope * (size[1] / 2) * offset.s) / (1 - slope * offset.s)
        d = slope * (from_x - size[1] / 2)
        waved = sum(np.sin(a * from_x + b * (y + d * offset.t) + p) for (a, b), p in zip(waves, phases))
        return bytes_from_encoded(np.repeat((0.5 + 0.06 * waved)[..., None], 3, -1).astype(np.float32))

    return [view(offset) for offset in offsets], slope * (x - size[1] / 2)


@pytest.mark.parametrize(
    ("slope", "offsets", "limit"), [(0.0, OFFSETS, 0.005), (-0.03, OFFSETS, 0.015), (0.05, PAIR, 0.05)]
)
def test_a_slanted_plane_comes_back_to_fractions_of_a_pixel(slope, offsets, limit):
    views, truth = slanted_views(slope, offsets)
    error = np.abs(find(views, offsets) - truth)[8:-8, 8:-8]
    assert np.median(error) < 0.3 * limit
    assert np.quantile(error, 0.95) < limit


def test_the_coarse_map_of_a_large_pair_counts_its_own_pixels():
    views, truth = slanted_views(0.03, PAIR, (200, 400))
    coarse = estimate_coarse(views, PAIR, 0)
    assert np.median(np.abs(coarse.values - truth)[16:-16, 16:-16]) < 0.6
    assert coarse.range_px[0] < np.quantile(truth, 0.02)
    assert coarse.range_px[1] > np.quantile(truth, 0.98)


def test_parts_that_one_view_of_a_pair_hides_are_filled_by_similar_colours():
    """A bright square, 8 px nearer than a dark wall: the wall to its left is hidden in the other view."""
    rng = np.random.default_rng(8)
    wall, square = (np.kron(rng.integers(*levels, (40, 52)), np.ones((2, 2))) for levels in ((0, 90), (160, 250)))
    views = []
    for at in (40, 32):
        view = wall.copy()
        view[20:60, at : at + 30] = square[20:60, 40:70]
        views.append(np.repeat(view[..., None], 3, -1).astype(np.uint8))
    found = estimate_disparity(views, PAIR, 0, (-2.0, 12.0))
    assert np.median(np.abs(found[24:56, 32:36])) < 1.5  # 5.3 without the check of both views
    assert np.abs(found[24:56, 44:66] - 8).max() < 1


@pytest.mark.parametrize("value", [np.nan, -np.inf])
def test_wild_colours_and_views_without_texture_give_something_finite(value):
    views = [(view / np.float16(255)).astype(np.float16) for view in slanted_views(0.02, PAIR)[0]]
    for view in views:
        view[20:30, 40:50] = value
    assert np.isfinite(find(views, PAIR)).all()
    assert np.isfinite(find([np.full((40, 50, 3), 255, np.uint8)] * 2, PAIR)).all()


def test_small_views_and_equal_viewpoints_are_refused():
    with pytest.raises(InputError, match="too small"):
        estimate_coarse([np.zeros((1, 40, 3), np.uint8)] * 2, PAIR, 0)
    with pytest.raises(InputError, match="the same viewpoint"):
        estimate_coarse([np.zeros((20, 40, 3), np.uint8)] * 2, [ViewOffset(0.0, 0.0)] * 2, 0)


def slow_confirmed(maps, offsets, index):
    result = np.zeros(maps[0].shape, bool)
    for y, x in np.ndindex(*maps[0].shape):
        agreeing = behind = 0
        for other, at in enumerate(offsets):
            if other == index:
                continue
            t, s = at.t - offsets[index].t, at.s - offsets[index].s
            d = maps[index][y, x]
            row = round(float(np.float32(y) - d * np.float32(t)))
            column = round(float(np.float32(x) - d * np.float32(s)))
            if 0 <= row < len(result) and 0 <= column < len(result[0]):
                nearer, largest = maps[other][row, column] - d, np.float32(1 / max(abs(t), abs(s)))
                agreeing += abs(nearer) <= largest
                behind += nearer < -largest
        result[y, x] = agreeing > 0 and agreeing >= behind
    return result


def test_maps_confirm_each_other_as_defined():
    """Several of six maps may look through a point that one confirms, and several may hide it."""
    offsets = [ViewOffset(0.0, -2.0), ViewOffset(0.0, 0.0), ViewOffset(1.0, 2.0), *OFFSETS[:3]]
    maps = list(np.random.default_rng(1).uniform(-2, 2, (6, 20, 26)).astype(np.float32))
    for index in range(6):
        confirmed = find_confirmed(maps, offsets, index)
        assert 0 < confirmed.mean() < 1
        assert (confirmed == slow_confirmed(maps, offsets, index)).all()


LINE = [ViewOffset(0.0, -2.0), ViewOffset(0.0, 0.0), ViewOffset(0.0, 2.0)]


def textured(size=(40, 56), seed=0):
    blocks = np.random.default_rng(seed).integers(0, 255, (size[0] // 2, size[1] // 2, 3))
    return np.kron(blocks, np.ones((2, 2, 1))).astype(np.uint8)


@pytest.mark.parametrize(
    ("grid", "matched"), [((3, 3), "x.x/.x./x.x"), ((1, 2), "xx"), ((1, 5), "x.x.x"), ((4, 4), "x.xx/.x.x/x.x./xx.x")]
)
def test_views_between_matched_views_are_not_matched(grid, matched):
    offsets = [GridShape(*grid).offset(*at) for at in np.ndindex(*grid)]
    marks = ["x" if index in matched_views(offsets) else "." for index in range(len(offsets))]
    assert "/".join("".join(row) for row in np.reshape(marks, grid)) == matched


@pytest.mark.parametrize("value", [None, np.nan])
def test_a_view_between_shows_the_same_wall_even_with_wild_colours(value):
    wall = textured() if value is None else (textured() / np.float16(255)).astype(np.float16)
    views = [np.roll(wall, shift, axis=1) for shift in (2, 0, -2)]
    for view in views if value is not None else ():
        view[10:14, 20:24] = value
    maps = estimate_all(views, LINE, (-2.0, 3.0))
    assert all(np.isfinite(values).all() for values in maps)
    error = np.abs(maps[1] - 1.0)
    error[6:18, 12:32] = 0
    assert error[4:-4, 8:-8].max() < 0.1


def test_a_wrong_patch_takes_the_disparity_of_similar_colours():
    maps = [np.full((30, 40), 1.0, np.float32) for _ in LINE]
    maps[1][10:14, 10:14] = 5.0
    assert all((values == 1.0).all() for values in reconcile([np.full((30, 40, 3), 90, np.uint8)] * 3, maps, LINE))
