import numpy as np

from iibr_core.method.rays import rays_of_photo
from iibr_core.method.update_loop import update
from iibr_core.method.view import Renderer
from iibr_core.types import ViewOffset

LEFT, RIGHT = ViewOffset(0.0, -2.0), ViewOffset(0.0, 2.0)


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
