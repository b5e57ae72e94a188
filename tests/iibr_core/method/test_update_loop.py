"""The views that complete a ray set, and the loop that does it."""

import itertools

import numpy as np
import pytest

from iibr_core.method.farthest_views import farthest_views, outer_views, outer_views_of_grid
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.update_loop import complete_ray_set, update
from iibr_core.method.view import Renderer
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.types import GridShape, ViewOffset
from tests.iibr_core.method.filled_rays import filled_rays
from tests.iibr_core.red_inpainter import paint_red
from tests.iibr_core.scenes import square_before_wall

LEFT, RIGHT = ViewOffset(0.0, -2.0), ViewOffset(0.0, 2.0)


def rays():
    photo, disparity = square_before_wall(30, 40, 3.0)
    return rays_of_photo(photo.pixels, disparity.values, 2.0, 2)


def test_outer_views_are_the_corners_of_what_is_asked_for():
    square = [ViewOffset(float(t), float(s)) for t in (-2, 0, 1) for s in (-1, 3)]
    assert set(outer_views(square)) == {(-2, -1), (1, 3), (-2, 3), (1, -1)}
    assert outer_views([ViewOffset(0.0, 1.0)]) == [(0, 1)]
    assert outer_views([ViewOffset(0.0, 0.0)]) == []


@pytest.mark.parametrize("grid", [GridShape(*shape) for shape in itertools.product((1, 2, 3, 4, 9), repeat=2)], ids=str)
def test_those_of_a_grid_are_views_of_it_in_the_order_of_its_indices(grid):
    bottom, right = grid.rows - 1, grid.columns - 1
    indices = [(0, 0), (bottom, right), (0, right), (bottom, 0)]
    expected = [grid.offset(*index) for index in dict.fromkeys(indices) if index != grid.centre]
    every = [grid.offset(v, u) for v in range(grid.rows) for u in range(grid.columns)]
    assert outer_views_of_grid(grid) == outer_views(every) == expected
    assert farthest_views(expected) == max(1.0, *(abs(part) for offset in every for part in offset))


def test_what_a_view_disocclused_has_joined_the_rays_when_it_is_yielded():
    seen = rays()
    photo_images = len(seen)
    with Renderer() as synthesis:
        expected = synthesis.render(rays(), LEFT)
    for count, (offset, view) in enumerate(update(seen, [LEFT, RIGHT]), 1):
        assert len(seen) == photo_images + count
        if offset == LEFT:
            np.testing.assert_array_equal(view.colors, expected.colors)
            _, colors, disparity, coverage, *_ = seen.arrays
            for added, filled in zip((colors[-1], disparity[-1], coverage[-1]), filled_rays(view)):
                np.testing.assert_array_equal(added, filled)
            assert (coverage[-1] > 0)[view.occluded].all()
    with Renderer() as synthesis:
        again = synthesis.render(seen, LEFT)
    assert expected.occluded.any()
    assert not again.occluded.any(), "a hole that was inpainted is none any more"
    assert again.inpainted[expected.occluded].all()


def test_views_that_disocclude_nothing_add_nothing():
    seen = rays()
    before = len(seen)
    (view,) = (view for _, view in update(seen, [ViewOffset(0.0, 0.0)]))
    assert not view.occluded.any()
    assert len(seen) == before


def test_completing_is_taking_all_views():
    completed, taken = rays(), rays()
    complete_ray_set(completed, [LEFT, RIGHT])
    assert len(list(update(taken, [LEFT, RIGHT]))) == 2
    for one, other in zip(completed.arrays, taken.arrays):
        np.testing.assert_array_equal(one, other)


def test_the_inpainter_decides_what_joins():
    seen = rays()
    for _, view in update(seen, [LEFT], inpainter=paint_red):
        colors, disparity, filled = filled_rays(view)
        assert view.occluded.any()
        assert (filled[view.occluded] == 1).all()
        assert (colors[filled == 1] == (1, 0, 0)).all()
        assert (disparity[filled == 1] == -9).all()
    np.testing.assert_array_equal(seen.arrays.disparity[-1] == -9, filled)


def test_a_stop_is_heard_and_adds_nothing():
    seen = rays()
    before = len(seen)
    with pytest.raises(Cancelled), stoppable(lambda: True):
        complete_ray_set(seen, [LEFT])
    assert len(seen) == before


def test_what_was_inpainted_farther_back_does_not_show_through_a_hole_in_the_photos_surface():
    disparity = np.full((30, 40), 3.0, np.float32)
    disparity[:, 18:26] = 6.0
    card, pole, wall = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    colors = np.where(disparity[..., None] > 3, np.float32(pole), np.float32(card))
    seen = rays_of_photo(colors, disparity, 2.0, 2)
    everywhere = np.ones_like(disparity)
    seen.add(LEFT, everywhere[..., None] * np.float32(wall), 0 * everywhere, everywhere)
    with Renderer() as synthesis:
        assert (synthesis.render(seen, RIGHT).colors[15, 15:19] == wall).all()
    ((_, view),) = update(seen, [RIGHT])
    assert (view.occluded & view.inpainted)[15, 15:19].all()
    np.testing.assert_allclose(view.colors[15, 15:19], np.tile(np.float32(card), (4, 1)), atol=1e-5)
    with Renderer() as synthesis:
        np.testing.assert_array_equal(synthesis.render(seen, RIGHT).colors[15, 15:19], view.colors[15, 15:19])
