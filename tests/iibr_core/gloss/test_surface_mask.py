import numpy as np

from iibr_core.gloss.settings import GlossStroke, GlossSurface
from iibr_core.gloss.surface_mask import surface_mask


def test_depth_and_colour_choose_the_surface():
    disparity = np.tile(np.linspace(0, 10, 11, dtype=np.float32), (3, 1))
    photo = np.zeros((3, 11, 3), np.float32)
    photo[1] = (1, 0, 0)
    near_red = GlossSurface(farthest=0.55, color=(1, 0, 0), tolerance=0.1)
    mask = surface_mask(near_red, photo, disparity)
    assert mask[1].tolist() == [0] * 6 + [1] * 5
    assert not mask[[0, 2]].any()


def test_strokes_mark_and_erase_in_their_order():
    flat, photo = np.zeros((20, 40), np.float32), np.zeros((20, 40, 3), np.float32)
    across = GlossStroke(((0.25, 0.5), (0.75, 0.5)), 0.05)
    middle = GlossStroke(((0.5, 0.5),), 0.05, erases=True)
    mask = surface_mask(GlossSurface(strokes=(across, middle), strokes_only=True), photo, flat)
    y, x = np.mgrid[:20, :40]
    path = np.abs(y - 9.5) ** 2 + np.maximum(np.abs(x - 19.5) - 10, 0) ** 2 <= 4
    hole = (y - 9.5) ** 2 + (x - 19.5) ** 2 <= 4
    assert np.array_equal(mask > 0, path & ~hole)


def test_strokes_beyond_the_picture_mark_what_of_it_they_reach():
    flat, photo = np.zeros((10, 10), np.float32), np.zeros((10, 10, 3), np.float32)
    far = GlossStroke(((-0.9, -0.9),), 0.01)
    corner = GlossStroke(((-0.05, 0.05),), 0.2)
    mask = surface_mask(GlossSurface(strokes=(far, corner), strokes_only=True), photo, flat)
    assert mask[0, 0] == 1
    assert mask.sum() < 10
