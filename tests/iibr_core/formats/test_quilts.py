"""Quilts: the shapes of displays, of tiles, and of what is drawn for any display."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from iibr_core.formats.quilts import DEVICES, USUAL_SIDE_PX, Quilt, lay_out, quilt_for, quilt_named, tagged
from iibr_core.types import ImageSize, InputError


@pytest.mark.parametrize("name", DEVICES)
def test_displays_are_9_to_16_3_to_4_or_16_to_9_and_their_quilts_square(name: str) -> None:
    quilt = quilt_for(name, ImageSize(10, 10))
    assert quilt.size.width == pytest.approx(quilt.size.height, rel=1e-3)
    is_upright = name == "go" or "portrait" in name
    assert any(
        quilt.aspect == pytest.approx(aspect, abs=1e-3) for aspect in ((9 / 16, 3 / 4) if is_upright else (16 / 9,))
    )


@pytest.mark.parametrize("view", [ImageSize(64, 96), ImageSize(3000, 4000), ImageSize(5000, 300), ImageSize(900, 9)])
def test_for_any_display_views_keep_their_shape_and_are_never_larger(view: ImageSize) -> None:
    quilt = quilt_for(None, view)
    assert quilt.aspect == view.width / view.height
    assert quilt.views == 48
    assert max(quilt.size) <= USUAL_SIDE_PX + 8
    assert all(1 <= side <= full for side, full in zip(quilt.tile, view))
    if view == (64, 96):
        assert quilt.tile == view
    elif view.width > 900:
        assert quilt.tile.width / quilt.tile.height == pytest.approx(quilt.aspect, rel=0.03)


def test_views_are_laid_out_from_the_lower_left() -> None:
    quilt = Quilt(3, 2, ImageSize(9, 13), 1.0)
    assert quilt.tile == (4, 4)
    whole = lay_out(quilt, [np.full((4, 4, 3), 10 * (view + 1), np.uint8) for view in range(6)])
    assert whole[8, 0, 0] == 10
    assert whole[8, 11, 0] == 30
    assert whole[1, 0, 0] == 40
    assert (whole[0] == 0).all(), "what is left over stays black, at the top and at the right"
    assert (whole[:, 12] == 0).all()


@pytest.mark.parametrize("count", [5, 7])
def test_as_many_views_as_the_quilt_has(count: int) -> None:
    with pytest.raises(ValueError, match="6"):
        lay_out(Quilt(3, 2, ImageSize(8, 12), 1.0), [np.zeros((4, 4, 3), np.uint8)] * count)
    with pytest.raises(ValueError, match=r"\(4, 5\)"):
        lay_out(Quilt(3, 2, ImageSize(8, 12), 1.0), [np.zeros((4, 5, 3), np.uint8)] * 6)


def test_a_name_tells_the_quilt_and_a_tag_comes_once() -> None:
    quilt = quilt_named(Path("a_qs8x6a0.75.png"), ImageSize(60, 80))
    assert quilt == Quilt(8, 6, ImageSize(60, 80), 0.75)
    assert quilt.tag == "_qs8x6a0.75"
    assert tagged(tagged(Path("b/a.png"), quilt.tag), quilt.tag) == Path("b/a_qs8x6a0.75.png")
    assert quilt_named(Path("a.png"), ImageSize(60, 80)) is None
    assert quilt_named(Path("a_qs8x6a0.75.png"), ImageSize(6, 8)) is not None, "a pixel a view"
    with pytest.raises(InputError, match="too few"):
        quilt_named(Path("a_qs8x6a0.75.png"), ImageSize(5, 8))


@pytest.mark.parametrize(("columns", "rows", "aspect"), [(0, 1, 1), (1, 33, 1), (33, 1, 1), (1, 1, 0.009), (1, 1, 101)])
def test_quilts_that_are_none(columns: int, rows: int, aspect: float) -> None:
    with pytest.raises(InputError, match="a quilt of"):
        Quilt(columns, rows, ImageSize(100, 100), aspect)
    Quilt(32, 32, ImageSize(100, 100), 100)
    Quilt(1, 1, ImageSize(100, 100), 0.01)


def test_a_display_that_nobody_knows() -> None:
    with pytest.raises(InputError, match="give go, portrait"):
        quilt_for("hologram", ImageSize(10, 10))
