import numpy as np
import pytest

from iibr_core.inpainting.registry import DEFAULT_INPAINTER, INPAINTERS, MODEL_INPAINTERS, load_inpainter
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.view import Renderer
from iibr_core.types import InputError, ViewOffset
from tests.iibr_core.scenes import square_before_wall

OFFSET = ViewOffset(-1.0, 2.0)
FORE_PX = 3.0


def view_with_holes():
    photo, disparity = square_before_wall(60, 80, FORE_PX)
    view = Renderer().render(rays_of_photo(photo.pixels, disparity.values, 2.0, 0), OFFSET)
    view.colors[view.occluded], view.disparity[view.occluded] = np.nan, np.nan
    return view.colors, view.disparity, view.occluded, disparity.values


@pytest.mark.parametrize("name", MODEL_INPAINTERS)
def test_a_name_that_needs_a_folder_asks_for_it_and_an_unknown_one_is_told_the_others(name):
    for typed in (name, f"{name}:", f"{DEFAULT_INPAINTER}:folder"):
        with pytest.raises(InputError, match=f"{typed}: .*{name}:FOLDER"):
            load_inpainter(typed)
    with pytest.raises(InputError, match=f"magic: .*{DEFAULT_INPAINTER}"):
        load_inpainter("magic")


@pytest.mark.parametrize("name", INPAINTERS)
def test_holes_are_filled_and_nothing_else_changes(name):
    colors, disparity, hole, photo_disparity = view_with_holes()
    assert 0 < hole.sum() < hole.size / 2
    known = colors[~hole], disparity[~hole]
    load_inpainter(name)(colors, disparity, hole, photo_disparity, OFFSET)
    np.testing.assert_array_equal(colors[~hole], known[0])
    np.testing.assert_array_equal(disparity[~hole], known[1])
    assert np.isfinite(colors).all()
    assert (colors >= 0).all()
    assert np.isfinite(disparity).all()
    # The square hid what was disoccluded beside it; beyond the frame anything may go on.
    inside = np.s_[15:45, 20:60]
    assert (disparity[inside][hole[inside]] < FORE_PX / 2).all()
