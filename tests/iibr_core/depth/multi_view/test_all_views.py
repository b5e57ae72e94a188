"""Maps of all views of a light field: every other view is matched, their maps are warped to the others."""

import numpy as np
import pytest

from iibr_core.depth.multi_view.all_views import estimate_all, matched_views, reconcile
from iibr_core.depth.multi_view.estimate import estimate_coarse
from iibr_core.runtime.work import watched
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import render
from iibr_core.types import GridShape, ImageSize, ViewOffset

LINE = [ViewOffset(0.0, -2.0), ViewOffset(0.0, 0.0), ViewOffset(0.0, 2.0)]


def textured(size=(40, 56), seed=0):
    blocks = np.random.default_rng(seed).integers(0, 255, (size[0] // 2, size[1] // 2, 3))
    return np.kron(blocks, np.ones((2, 2, 1))).astype(np.uint8)


@pytest.mark.parametrize(
    ("grid", "matched"),
    [((3, 3), "x.x/.x./x.x"), ((1, 2), "xx"), ((1, 5), "x.x.x"), ((4, 4), "x.xx/.x.x/x.x./xx.x")],
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


def test_maps_of_a_drawn_field_are_right_and_progress_reaches_its_total():
    grid, size = GridShape(3, 3), ImageSize(96, 120)
    offsets = [ViewOffset(2 * t, 2 * s) for t, s in (grid.offset(*at) for at in np.ndindex(*grid))]
    scene = random_scene(np.random.default_rng(5), size, 2.0)
    drawn = [render(scene, size, offset, samples=2) for offset in offsets]
    views = [(255 * colors + 0.5).astype(np.uint8) for colors, _ in drawn]
    reports = []
    with watched(lambda *now: reports.append(now)):
        maps = estimate_all(views, offsets, estimate_coarse(views, offsets, 4).range_px)
    done, totals, _ = zip(*reports)
    assert list(done) == sorted(done)
    assert set(totals) == {done[-1]}
    wrong = np.mean([np.abs(values - truth) > 0.25 for values, (_, truth) in zip(maps, drawn)])
    assert wrong < 0.12
