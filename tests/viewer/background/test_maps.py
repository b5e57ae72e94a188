"""The entropy map of a view, beside a plain computation."""

import numpy as np

from iibr_core.inpainting.registry import DEFAULT_INPAINTER
from iibr_core.method.light_field import view_maker
from iibr_core.method.occlusion import view_entropy
from iibr_core.method.plan import plan_for_viewing
from iibr_core.scenes.photo import load_photo
from iibr_core.scenes.scene import Source
from tests.viewer.conftest import write_scene
from viewer.background.maps import EntropyRequest, EntropyWork


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
