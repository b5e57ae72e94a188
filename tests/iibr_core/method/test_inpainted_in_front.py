"""What is inpainted never covers what the photo shows: judged by plain warps, which know no ray sets."""

import numpy as np
import pytest
from scipy.ndimage import maximum_filter

from iibr_core.evaluation.reference_warp import reference_warp
from iibr_core.method.farthest_views import outer_views_of_grid, outpainting_margins
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.update_loop import complete_ray_set
from iibr_core.method.view import Renderer
from iibr_core.surfaces import EDGE_PX
from iibr_core.types import GridShape
from tests.iibr_core.scenes import smooth_texture

GRID, FARTHEST = GridShape(5, 5), 2.0
WALL, CORK, BOARD = -0.5, 1.5, 5.0


def board_cut_by_the_frame(slant):
    """(96, 128) colours and disparity: a slanted board and cork behind it run out of the right frame, before a wall."""
    y, x = np.indices((96, 128))
    disparity = np.full(y.shape, WALL, np.float32)
    disparity[(abs(y - 48) < 36) & (x > 60)] = CORK
    disparity[(abs(y - 48 - slant * (x - 127)) < 14) & (x > 90)] = BOARD
    texture = smooth_texture(96, 128)
    tint = np.where(disparity[..., None] == BOARD, np.float32([1.0, 0.3, 0.2]), np.float32([0.3, 0.6, 1.0]))
    return texture * tint, disparity


@pytest.mark.parametrize("slant", [-0.5, -0.3, 0.0, 0.5])
def test_no_view_shows_anything_inpainted_in_front_of_the_photo_and_its_continuation(slant):
    colors, disparity = board_cut_by_the_frame(slant)
    outer = outer_views_of_grid(GRID)
    margins = outpainting_margins(disparity, outer)
    assert margins.right > 0
    rays = rays_of_photo(colors, disparity, FARTHEST, len(outer), margins=margins)
    complete_ray_set(rays, outer)
    continued = rays.arrays.disparity[0]
    with Renderer() as synthesis:
        for row, column in np.ndindex(*GRID):
            offset = GRID.offset(row, column)
            view = synthesis.render(rays, offset)
            known = reference_warp(colors, disparity, offset).visible
            shown = reference_warp(np.zeros((*continued.shape, 3), np.float32), continued, offset)
            # Landings are rounded: what lies within a pixel counts.
            nearest = rays.in_view(maximum_filter(np.where(shown.hole, -np.inf, shown.disparity), 3))
            in_front = view.inpainted & known & (view.disparity > nearest + EDGE_PX / FARTHEST)
            assert not in_front.any()
