"""The entropy map of a view, beside a plain computation; the outline of a selected surface."""

from dataclasses import replace

import numpy as np
import pytest

from iibr_core.depth.editing.edits import Patch, Stroke
from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.method.light_field import view_maker
from iibr_core.method.occlusion import view_entropy
from iibr_core.method.plan import plan_for_viewing
from iibr_core.scenes.photo import load_photo
from iibr_core.scenes.scene import Source
from tests.viewer.conftest import HEIGHT, NEAR, WIDTH, write_scene
from viewer.background.maps import EntropyRequest, EntropyWork, SurfaceRequest, SurfaceWork


def test_the_map_is_the_entropy_of_the_weights_of_its_view(tmp_path):
    loaded = load_photo(Source(str(write_scene(tmp_path))))
    plan = plan_for_viewing(loaded.photo, loaded.disparity)
    found = []
    work = EntropyWork()
    for view in ((0, 0), plan.grid.centre, (0, 1)):
        work(EntropyRequest(1, view, loaded, plan, DEFAULT_INPAINTER), found.append)
    rays = view_maker(loaded.photo, plan.field_disparity(loaded.disparity), plan).rays
    corner, middle, above = (entropy.values for entropy in found)
    expected = view_entropy(rays, plan.grid.offset(0, 0))
    assert 0 <= expected.min() < expected.max() <= 1
    np.testing.assert_allclose(corner, expected * 255, atol=0.5)
    np.testing.assert_allclose(above, view_entropy(rays, plan.grid.offset(0, 1)) * 255, atol=0.5)
    assert not middle.any(), "every ray of the middle view is the photo's"


def test_a_selected_surface_is_shown_by_its_outline_also_where_the_brush_erased(tmp_path):
    loaded = load_photo(Source(str(write_scene(tmp_path))))
    plan = plan_for_viewing(loaded.photo, loaded.disparity)
    clicked, found = Stroke("forward", ((0.5, 0.5),), 0.03, 0.1), []
    erased = Patch(((0.5, 0.5),), 0.1, erases=True)
    work = SurfaceWork()
    for stroke in (clicked, replace(clicked, patches=(erased,)), replace(clicked, points=((0.1, 0.1),))):
        work(SurfaceRequest(stroke, loaded, plan), found.append)
    whole, cut, wall = (surface.outline > 0 for surface in found)
    assert (wall.any(), (wall & whole).any()) == (True, False)
    assert found[2].range_px[1] < found[0].range_px[0], "another surface is found anew"
    rows, columns = np.nonzero(whole)
    assert (rows.min(), rows.max() + 1) == (HEIGHT // 4, 3 * HEIGHT // 4)
    assert (columns.min(), columns.max() + 1) == (WIDTH // 3, 2 * WIDTH // 3)
    assert whole.sum() == pytest.approx(2 * (HEIGHT // 2 + WIDTH // 3) - 4, abs=8), "one pixel wide, but for corners"
    assert cut.sum() > whole.sum()
    assert not whole[HEIGHT // 2, WIDTH // 2]
    near_px = (NEAR - plan.disparity_zero) * plan.disparity_scale
    assert found[0].range_px == pytest.approx((near_px, near_px), abs=0.05)
