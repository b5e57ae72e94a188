"""Places of things in windows of several sizes, with and without panel, strips, filmstrip and zoom."""

import pytest

from iibr_core.scenes.rect import Rect
from iibr_core.types import GridShape
from tests.golden_text import assert_same_text
from tests.viewer.model.told import EXACT, words
from viewer.model.inspection import sheet_cells, view_at
from viewer.model.layout import Beside, Zoom, is_narrow, layout_of, pixel_at, whole_pixels

ALL = Beside((4, 9), True, True)
LAYOUTS = {
    "usual": ((1280, 800), (600, 400)), "no picture": ((1280, 800), None), "no room": ((200, 60), (600, 400)),
    "high": ((700, 900), (40, 90), 2.0, 1.5), "alone": ((1280, 800), (600, 400), 1.0, 1.0, Beside(), False),
    "all beside": ((1280, 800), (601, 399), 1.0, 1.0, ALL),
    "all beside, large": ((1500, 1100), (601, 399), 1.5, 1.25, Beside((1, 17), True, True)),
    "1:1": ((1280, 800), (600, 400), 1.0, 1.0, Beside(), True, Zoom(1.0), 4800),
    "at a corner": ((1280, 800), (600, 400), 2.0, 1.0, ALL, True, Zoom(0.7, (1.0, 0.0)), 4800),
    "beside the middle": ((1280, 800), (600, 400), 1.5, 1.0, Beside(), False, Zoom(2.3, (0.31, 0.77)), 4800),
    "small photo": ((1280, 800), (60, 40), 1.0, 1.0, Beside(), True, Zoom(1.0)),
    "one side fits": ((1280, 800), (60, 40), 1.0, 1.0, Beside(), True, Zoom(18.0, (0.2, 0.9))),
}  # fmt: skip
PARTS = (
    "panel", "picture", "room", "frame", "frame_px", "part", "minimap", "strip_across", "strip_down", "status",
    "filmstrip", "is_zoomed", "scale", "fit",
)  # fmt: skip


def test_everything_lies_where_it_should(regenerate_golden):
    lines = []
    for name, arguments in LAYOUTS.items():
        layout = layout_of(*arguments)
        lines += [name, *(f"    {part}: {words(getattr(layout, part))}" for part in PARTS)]
        for notches in (1.0, -1.0, 0.2, 100.0, -100.0):
            lines.append(f"    wheel {notches:g}: {words(layout.zoomed(notches, 400.0, 300.0))}")
        for step in ((30.0, -20.0), (1e6, 1e6)):
            lines.append(f"    pulled by {step}: {words(layout.pulled(*step))}")
        lines.append(f"    on the small picture: {words(layout.shown_on_minimap(900.0, 700.0))}")
    lines.append(words(whole_pixels(Rect(1.4, 2.6, 3.3, 0.1))))
    lines.append(words([is_narrow((width, 500), scale) for width in (719, 720, 1439) for scale in (1.0, 2.0)]))
    assert_same_text(lines, "viewer/stories", "layouts", regenerate_golden, *EXACT)


@pytest.mark.parametrize("name", [name for name in LAYOUTS if "no " not in name])
def test_the_pixels_of_the_frame_show_the_part_that_lies_there(name):
    size, layout = LAYOUTS[name][1], layout_of(*LAYOUTS[name])
    picture, px, part, ratio = layout.picture, layout.frame_px, layout.part, layout.pixel_ratio
    assert tuple(layout.frame.within(layout.room)) == pytest.approx(tuple(layout.frame))
    assert px.width == pytest.approx(part.width * picture.width * ratio, abs=1)
    for x_share, y_share in ((0.0, 0.0), (0.3, 0.9)):
        x, y = (px.x + x_share * px.width) / ratio, (px.y + y_share * px.height) / ratio
        at = pixel_at(picture, size, x, y)
        assert (at[0] + 0.5) / size[0] == pytest.approx(part.x + x_share * part.width, abs=1 / px.width)
        assert (at[1] + 0.5) / size[1] == pytest.approx(part.y + y_share * part.height, abs=1 / px.height)


@pytest.mark.parametrize("notches", [1.0, 3.0, -1.0, 0.2])
def test_what_lies_under_the_pointer_stays_there_while_one_zooms(notches):
    size, arguments = (600, 400), ((1280, 800), (600, 400), 2.0, 1.0, ALL, True)
    before = layout_of(*arguments, Zoom(0.6, (0.4, 0.6)), 4800)
    after = layout_of(*arguments, before.zoomed(notches, 420.0, 300.0), 4800)
    there, here = (pixel_at(layout.picture, size, 420.0, 300.0) for layout in (before, after))
    assert here == pytest.approx(there, abs=size[0] / after.picture.width)  # the picture lies on whole pixels


@pytest.mark.parametrize("grid", [GridShape(1, 1), GridShape(3, 9), GridShape(9, 2), GridShape(16, 17)])
def test_a_click_on_the_sheet_finds_the_view_drawn_there(grid):
    picture = Rect(12, 30, 600, 400)
    cells = sheet_cells(picture, grid)
    for i, cell in enumerate(cells):
        assert cell.width / cell.height == pytest.approx(1.5)
        assert view_at(picture, grid, 1.0, cell.x + cell.width / 2, cell.y + 1) == divmod(i, grid.columns)
        assert picture.contains(cell.x, cell.y)
        assert picture.contains(cell.x + cell.width, cell.y + cell.height)
    assert view_at(picture, grid, 1.0, picture.x, picture.y) is None
    (left, top, *_), (*_, width, height) = cells[0], cells[-1]
    ends = cells[-1].x + width, cells[-1].y + height
    assert (left + ends[0] - 2 * picture.x, top + ends[1] - 2 * picture.y) == pytest.approx((600, 400)), "in the middle"
