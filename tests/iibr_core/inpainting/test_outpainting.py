import numpy as np

from iibr_core.method.farthest_views import outer_views_of_grid, outpainting_margins
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.update_loop import update
from iibr_core.method.view import Renderer
from iibr_core.types import GridShape, ViewOffset
from tests.iibr_core.scenes import smooth_texture


def textured_wall(disparity):
    """Return the complete ray set of a wall that moves as a whole, for a grid of 5 x 5 views."""
    values = np.full((40, 44), disparity, np.float32)
    outer = outer_views_of_grid(GridShape(5, 5))
    rays = rays_of_photo(smooth_texture(40, 44), values, 2.0, 8, margins=outpainting_margins(values, outer))
    list(update(rays, outer, Renderer()))
    return rays


def test_views_agree_beyond_the_frame_and_say_that_it_is_inpainted():
    rays = textured_wall(3.0)
    corner, half, photo = (Renderer().render(rays, ViewOffset(at, at)) for at in (2.0, 1.0, 0.0))
    np.testing.assert_array_equal(photo.colors, smooth_texture(40, 44))
    assert not photo.inpainted.any()
    assert not corner.occluded.any()
    expected = np.ones((40, 44), np.bool_)
    expected[:34, :38] = False
    np.testing.assert_array_equal(corner.inpainted, expected)
    # The same content, three pixels on.
    np.testing.assert_allclose(corner.colors[:-3, :-3], half.colors[3:, 3:], atol=1e-5)


def test_what_moves_farther_than_the_margins_reach_is_filled_by_the_views():
    rays = textured_wall(20.0)
    assert rays.margins == (10, 10, 11, 11)
    view = Renderer().render(rays, ViewOffset(2.0, 2.0))
    assert np.isfinite(view.colors).all()
    assert view.inpainted.all()
