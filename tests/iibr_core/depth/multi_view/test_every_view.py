"""Maps of all views of a light field: every other one is matched, the others are carried."""

import numpy as np
import pytest

from iibr_core.depth.multi_view.estimate_disparity import estimate_coarse
from iibr_core.depth.multi_view.every_view import _carry, estimate_all, matched_views
from iibr_core.runtime.work import Cancelled, stoppable, watched
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import render
from iibr_core.types import GridShape, ImageSize, ViewOffset

LINE = [ViewOffset(0.0, -2.0), ViewOffset(0.0, 0.0), ViewOffset(0.0, 2.0)]


def textured(size=(40, 56), seed=0):
    blocks = np.random.default_rng(seed).integers(0, 255, (size[0] // 2, size[1] // 2, 3))
    return np.kron(blocks, np.ones((2, 2, 1))).astype(np.uint8)


@pytest.mark.parametrize(
    ("grid", "matched"),
    [
        ((3, 3), "x.x/.x./x.x"),
        ((2, 2), "xx/xx"),
        ((1, 2), "xx"),
        ((1, 5), "x.x.x"),
        ((2, 3), "x.x/xxx"),
        ((4, 4), "x.xx/.x.x/x.x./xx.x"),
    ],
)
def test_views_on_both_sides_of_which_others_are_matched_are_carried(grid, matched):
    offsets = [GridShape(*grid).offset(*at) for at in np.ndindex(*grid)]
    marks = ["x" if index in matched_views(offsets) else "." for index in range(len(offsets))]
    assert "/".join("".join(row) for row in np.reshape(marks, grid)) == matched


def test_a_carried_map_is_what_the_matched_ones_show_there():
    wall = textured()
    views = [np.roll(wall, shift, axis=1) for shift in (2, 0, -2)]
    maps = estimate_all(views, LINE, (-2.0, 3.0))
    assert np.abs(maps[1] - 1.0)[4:-4, 8:-8].max() < 0.1


def test_what_the_nearest_views_do_not_see_is_carried_from_the_next():
    """A slit in a panel, as wide as the panel moves: the views beside see another part of the wall, those above and
    below, which are farther, see the same. Colours tell nothing.
    """
    offsets = [ViewOffset(0, 0), ViewOffset(0, -1), ViewOffset(0, 1), ViewOffset(-1.5, 0), ViewOffset(1.5, 0)]
    maps = {}
    for index, at in enumerate(offsets):
        y, x = np.mgrid[:48, :64]
        column, row = x + 4 * at.s, y + 4 * at.t  # where the panel's point stands in the first view
        is_panel = (column >= 12) & (column < 52) & (row >= 8) & (row < 40) & ~((column >= 30) & (column < 34))
        maps[index] = np.where(is_panel, 4.0, 0.0).astype(np.float32)
    views = [np.full((48, 64, 3), 90, np.uint8)] * 5
    del maps[0]
    carried = _carry(maps, views, offsets, 0)
    np.testing.assert_allclose(carried[16:32, 31:33], 0.0, atol=0.01)
    np.testing.assert_allclose(carried[16:32, [28, 35]], 4.0, atol=0.01)


def test_maps_that_show_nothing_of_a_view_between_are_taken_as_they_are():
    views = [textured((16, 24), seed) for seed in range(3)]
    maps = estimate_all(views, LINE, (900.0, 901.0))
    assert all(np.isfinite(values).all() for values in maps)
    assert all(((values >= 900.0) & (values <= 901.0)).all() for values in maps)


def test_it_ends_when_it_should_stop_while_maps_are_carried():
    views, told = [textured()] * 3, []
    with watched(lambda *progress: told.append(progress)):
        estimate_all(views, LINE, (-1.0, 1.0))
    last, seen = told[-2], []
    with pytest.raises(Cancelled), stoppable(lambda: last in seen), watched(lambda *progress: seen.append(progress)):
        estimate_all(views, LINE, (-1.0, 1.0))
    assert told[-1] not in seen


def test_views_without_any_texture_get_finite_maps():
    views = [np.full((24, 32, 3), 90, np.uint8)] * 3
    range_px = estimate_coarse(views, LINE, 1).range_px
    assert all(np.isfinite(values).all() for values in estimate_all(views, LINE, range_px))


@pytest.mark.parametrize("value", [np.nan, np.inf])
def test_a_carried_map_does_not_mind_wild_colours_of_hdr_views(value):
    wall = (textured() / np.float16(255)).astype(np.float16)
    views = [np.roll(wall, shift, axis=1) for shift in (2, 0, -2)]
    for view in views:
        view[10:14, 20:24] = value
    maps = estimate_all(views, LINE, (-2.0, 3.0))
    assert all(np.isfinite(values).all() for values in maps)
    away = np.abs(maps[1] - 1.0)
    away[6:18, 12:32] = 0
    assert away[4:-4, 8:-8].max() < 0.1


def test_agreement_brings_estimated_maps_nearer_to_the_truth():
    grid, size = GridShape(3, 3), ImageSize(96, 120)
    offsets = [ViewOffset(2 * t, 2 * s) for t, s in (grid.offset(*at) for at in np.ndindex(*grid))]
    scene = random_scene(np.random.default_rng(5), size, 2.0)
    drawn = [render(scene, size, offset, samples=2) for offset in offsets]
    views = [(255 * colors + 0.5).astype(np.uint8) for colors, _ in drawn]
    told = []
    with watched(lambda *now: told.append(now)):
        maps = estimate_all(views, offsets, estimate_coarse(views, offsets, 4).range_px)
    done, total = [now[0] for now in told], {now[1] for now in told}
    assert done == sorted(done)
    assert len(total) == 1
    assert done[-1] == pytest.approx(told[-1][1])
    wrong = np.mean([np.abs(values - truth) > 0.25 for values, (_, truth) in zip(maps, drawn)])
    assert wrong < 0.12
