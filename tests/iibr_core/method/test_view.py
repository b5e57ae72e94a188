"""What covers a pixel in part comes over what was filled behind it: edge bands beside gaps are soft, not jagged."""

import numpy as np
import pytest

from iibr_core.color import linear_from_srgb, srgb_from_linear
from iibr_core.method.rays import rays_of_photo
from iibr_core.method.update_loop import update
from iibr_core.method.view import Renderer
from iibr_core.types import ViewOffset
from tests.iibr_core.method.filled_rays import filled_rays
from tests.iibr_core.red_inpainter import paint_red

FOREGROUND, WALL = np.float32([0.9, 0.6, 0.3]), np.float32([0.1, 0.2, 0.5])
HEIGHT, WIDTH, FIRST, LAST = 40, 48, 16, 30
"""A foreground in columns [FIRST, LAST), at disparity 6 before 0."""
LEFT, RIGHT = ViewOffset(0.0, -1.0), ViewOffset(0.0, 1.0)


def mixed(share):
    return srgb_from_linear(share * linear_from_srgb(FOREGROUND) + (1 - share) * linear_from_srgb(WALL))


def bar(share):
    """A photo of a plain bar before a plain wall; the bar covers `share` of the column beside it on either side."""
    colors = np.tile(WALL, (HEIGHT, WIDTH, 1))
    colors[:, FIRST:LAST] = FOREGROUND
    colors[:, [FIRST - 1, LAST]] = mixed(share)
    disparity = np.zeros((HEIGHT, WIDTH), np.float32)
    disparity[:, FIRST:LAST] = 6.0
    return rays_of_photo(colors, disparity, 1.0, 2)


@pytest.mark.parametrize("share", [0.15, 0.3, 0.45, 0.55])
@pytest.mark.parametrize("offset", [LEFT, RIGHT], ids=["left", "right"])
def test_a_rim_beside_a_gap_is_the_front_over_what_was_filled(share, offset):
    with Renderer() as synthesis:
        view = synthesis.render(bar(share), offset)
    moved = round(-6 * offset.s)
    row = view.colors[HEIGHT // 2]
    assert row[FIRST + moved : LAST + moved] == pytest.approx(np.tile(FOREGROUND, (LAST - FIRST, 1)), abs=2e-3)
    for edge in (FIRST - 1 + moved, LAST + moved):
        assert row[edge] == pytest.approx(mixed(share), abs=5e-3)
    rest = np.r_[8 : FIRST - 1 + moved, LAST + 1 + moved : WIDTH - 8]
    assert row[rest] == pytest.approx(np.tile(WALL, (len(rest), 1)), abs=5e-3), "nothing of the foreground stays behind"


def test_rays_join_without_what_comes_over_them():
    rays = bar(0.3)
    list(update(rays, [RIGHT], inpainter=paint_red))
    _, colors, _, coverage, *_ = rays.arrays
    assert (colors[-1][coverage[-1] > 0] == (1, 0, 0)).all()


def test_what_is_filled_shows_beside_the_edge():
    with Renderer(inpainter=paint_red) as synthesis:
        view = synthesis.render(bar(0.3), RIGHT)
    edge = view.colors[HEIGHT // 2, LAST - 6]
    light = 0.3 * linear_from_srgb(FOREGROUND) + 0.7 * linear_from_srgb(np.float32([1, 0, 0]))
    assert edge == pytest.approx(srgb_from_linear(light), abs=5e-3)


def test_where_nothing_lies_open_nothing_is_behind():
    with Renderer() as synthesis:
        view = synthesis.render(bar(0.0), ViewOffset(0.0, 0.0))
    assert view.behind is None
    assert filled_rays(view)[2].max() == 0
    assert not view.has_filled_rays
