"""The loop that completes a ray set with what the farthest views disocclude."""

import numpy as np
import pytest

from iibr_core.method.rays import rays_of_photo
from iibr_core.method.update_loop import update
from iibr_core.method.view import Renderer
from iibr_core.types import ViewOffset
from tests.iibr_core.method.filled_rays import filled_rays
from tests.iibr_core.red_inpainter import paint_red
from tests.iibr_core.scenes import square_before_wall

LEFT, RIGHT = ViewOffset(0.0, -2.0), ViewOffset(0.0, 2.0)


@pytest.fixture
def rays():
    photo, disparity = square_before_wall(30, 40, 3.0)
    return rays_of_photo(photo.pixels, disparity.values, 2.0, 2)


def test_what_a_view_disoccluded_has_joined_the_rays_when_it_is_yielded(rays):
    photo_images, renderer = len(rays), Renderer()
    expected = renderer.render(rays, LEFT)
    for count, (offset, view) in enumerate(update(rays, [LEFT, RIGHT], renderer), 1):
        assert len(rays) == photo_images + count
        if offset == LEFT:
            np.testing.assert_array_equal(view.colors, expected.colors)
            added = rays.arrays.colors[-1], rays.arrays.disparity[-1], rays.arrays.coverage[-1]
            for one, filled in zip(added, filled_rays(view)):
                np.testing.assert_array_equal(one, filled)
            assert (added[2] > 0)[view.occluded].all()
    again = renderer.render(rays, LEFT)
    assert expected.occluded.any()
    assert not again.occluded.any(), "a hole that was inpainted is none any more"
    assert again.inpainted[expected.occluded].all()


def test_the_inpainter_decides_what_joins(rays):
    ((_, view),) = update(rays, [LEFT], Renderer(inpaint=paint_red))
    colors, disparity, filled = filled_rays(view)
    assert (filled[view.occluded] == 1).all()
    assert (colors[filled == 1] == (1, 0, 0)).all()
    assert (disparity[filled == 1] == -9).all()
    np.testing.assert_array_equal(rays.arrays.disparity[-1] == -9, filled)


def test_what_was_inpainted_farther_back_does_not_show_through_a_hole_in_the_photos_surface():
    disparity = np.full((30, 40), 3.0, np.float32)
    disparity[:, 18:26] = 6.0
    card, pole, wall = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    colors = np.where(disparity[..., None] > 3, np.float32(pole), np.float32(card))
    rays, renderer = rays_of_photo(colors, disparity, 2.0, 2), Renderer()
    everywhere = np.ones_like(disparity)
    rays.add(LEFT, everywhere[..., None] * np.float32(wall), 0 * everywhere, everywhere)
    assert (renderer.render(rays, RIGHT).colors[15, 15:19] == wall).all()
    ((_, view),) = update(rays, [RIGHT], renderer)
    assert (view.occluded & view.inpainted)[15, 15:19].all()
    np.testing.assert_allclose(view.colors[15, 15:19], np.tile(np.float32(card), (4, 1)), atol=1e-5)
    np.testing.assert_array_equal(renderer.render(rays, RIGHT).colors[15, 15:19], view.colors[15, 15:19])
