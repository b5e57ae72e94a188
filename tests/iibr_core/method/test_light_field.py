import itertools

import numpy as np

from iibr_core.inpainting.registry import INPAINTERS
from iibr_core.method.light_field import ViewMaker
from iibr_core.types import ViewOffset
from tests.iibr_core import red_inpainter
from tests.iibr_core.scenes import by_index, generate, literal_plan, square_before_wall


def views_of(photo, disparity, rows, columns=None, **options):
    return by_index(list(generate(photo, disparity, literal_plan(photo, disparity, rows, columns), **options)))


def test_views_arrive_photo_first_then_farthest_then_nearest_to_the_eye():
    photo, disparity = square_before_wall()
    plan = literal_plan(photo, disparity, 5)
    made = generate(photo, disparity, plan, nearest_to=lambda: ViewOffset(0.0, 1.0))
    order = [(v.row, v.column) for v in made]
    assert order[0] == (2, 2)
    assert set(order[1:5]) == {(0, 0), (0, 4), (4, 0), (4, 4)}
    assert order[5] == (2, 3)
    assert len(set(order)) == 25


def test_the_inpainter_of_that_name_fills_all_that_is_inpainted(monkeypatch):
    monkeypatch.setitem(INPAINTERS, "red", red_inpainter.ENTRY)
    photo, disparity = square_before_wall(60, 80, 3.0)
    red = views_of(photo, disparity, 5, inpaint="red")
    for view in red.values():
        inner = view.colors[view.inpainted & ~beside(~view.inpainted)]  # what lies beside is mixed in at edges
        assert (inner[:, :1] > 2.0 * inner[:, 1:]).all(), "the wall behind is blue"
    assert sum(view.inpainted.sum() for view in red.values()) > 0


def beside(mask):
    return sum(np.roll(mask, (j, i), axis=(0, 1)) for j in (-1, 0, 1) for i in (-1, 0, 1)) > 0


def test_all_views_show_the_same_content_in_a_hole():
    photo, disparity = square_before_wall(90, 120, 3.0)
    views = views_of(photo, disparity, 5)
    compared = 0
    for a, b in itertools.permutations([(2, 4), (1, 4), (2, 3), (0, 4), (4, 4)], 2):
        # The wall stands still (disparity 0): what both views see of it must be the same. Beside the square its
        # antialiased edge is mixed in, and the outermost pixels are at the frame.
        both = views[a].inpainted & ~beside(views[a].disparity > 0.5) & ~beside(views[b].disparity > 0.5)
        both[:6] = both[-6:] = both[:, :6] = both[:, -6:] = False
        difference = views[a].colors[both].astype(float) - views[b].colors[both]
        assert np.sqrt(np.mean(difference**2)) <= 1
        compared += both.sum()
    assert compared > 500


def test_wanted_views_alone_are_made():
    photo, disparity = square_before_wall()
    every, at = views_of(photo, disparity, 5), [ViewOffset(1.0, -1.0), ViewOffset(2.0, 2.0)]
    some = views_of(photo, disparity, 5, wanted=lambda: at)
    assert set(some) == {(2, 2), (3, 1), (4, 4)}
    assert all((view.colors == every[index].colors).all() for index, view in some.items())
    assert set(views_of(photo, disparity, 5, wanted=lambda: [])) == {(2, 2)}
    maker = ViewMaker(photo.pixels, disparity.values, at)
    assert maker.rays is maker.rays, "they are made once"
