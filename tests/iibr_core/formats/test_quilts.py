"""Quilts: the shapes of displays and tiles, and the quilt for any display."""

from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.quilts import MAX_USUAL_SIDE_PX, Quilt, lay_out, quilt_for, quilt_named, tagged
from iibr_core.types import ImageSize, InputError


@pytest.mark.parametrize("view", [ImageSize(64, 96), ImageSize(3000, 4000), ImageSize(5000, 300), ImageSize(900, 9)])
def test_for_any_display_views_keep_their_shape_and_are_never_larger(view: ImageSize) -> None:
    quilt = quilt_for(None, view)
    assert (quilt.aspect, quilt.views) == (view.width / view.height, 48)
    assert max(quilt.size) <= MAX_USUAL_SIDE_PX + 8
    assert all(1 <= side <= full for side, full in zip(quilt.tile, view))
    if view.width > 900:
        assert quilt.tile.width / quilt.tile.height == pytest.approx(quilt.aspect, rel=0.03)


def test_views_are_laid_out_from_the_lower_left_and_the_remainder_stays_black() -> None:
    quilt = Quilt(3, 2, ImageSize(9, 13), 1.0)
    whole = lay_out(quilt, [np.full((4, 4, 3), 10 * (view + 1), np.uint8) for view in range(6)])
    assert (whole[8, 0, 0], whole[8, 11, 0], whole[1, 0, 0]) == (10, 30, 40)
    assert not whole[0].any()
    assert not whole[:, 12].any()
    with pytest.raises(ValueError, match="zip"):
        lay_out(quilt, [np.zeros((4, 4, 3), np.uint8)] * 5)


def test_a_name_states_the_quilt_and_gets_one_tag() -> None:
    quilt = quilt_named(Path("a_qs8x6a0.75.png"), ImageSize(60, 80))
    assert quilt == Quilt(8, 6, ImageSize(60, 80), 0.75)
    assert tagged(tagged(Path("b/a.png"), quilt.tag), quilt.tag) == Path("b/a_qs8x6a0.75.png")
    assert quilt_named(Path("a.png"), ImageSize(60, 80)) is None
    with pytest.raises(InputError, match="too few"):
        quilt_named(Path("a_qs8x6a0.75.png"), ImageSize(5, 8))
