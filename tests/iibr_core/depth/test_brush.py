"""Strokes: their reach, contours, and a canvas that follows its edits."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iibr_core.depth.editing.canvas import DepthCanvas, apply_edits
from iibr_core.depth.editing.edits import BRUSH_TOOLS, DEPTH_TOOLS, UNEDITED, BrushTool, DepthEdits, Stroke

HEIGHT, WIDTH = 30, 40


def plain_photo(left: float = 0.3, right: float = 0.7) -> np.ndarray:
    """Two areas with a contour between them in the middle."""
    photo = np.full((HEIGHT, WIDTH, 3), left, np.float32)
    photo[:, WIDTH // 2 :] = right
    return photo


def tiled_photo(seed: int, brightest: float) -> np.ndarray:
    rng = np.random.default_rng(seed)
    tiles = rng.uniform(0, brightest, (HEIGHT // 5, WIDTH // 5, 3))
    return tiles.repeat(5, 0).repeat(5, 1).astype(np.float32)


def plane() -> np.ndarray:
    """A disparity that rises from left to right, 0 to 1."""
    return np.tile(np.linspace(0, 1, WIDTH, dtype=np.float32), (HEIGHT, 1))


def dab(
    tool: BrushTool = "nearer", x: float = 0.4, y: float = 0.5, radius: float = 0.2, strength: float = 0.5
) -> Stroke:
    return Stroke(tool, ((x, y),), radius, strength)


@pytest.mark.parametrize(("tool", "sign"), [("nearer", 1), ("farther", -1)])
def test_a_dab_moves_its_middle_by_its_strength_and_ends_at_its_radius(tool: BrushTool, sign: int) -> None:
    photo, disparity = np.full((61, 81, 3), 0.5, np.float32), np.linspace(0, 10, 61 * 81, dtype=np.float32)
    edits = DepthEdits(strokes=(dab(tool, 0.5, 0.5, 10 / 81, 0.25),))
    change = sign * (apply_edits(photo, disparity.reshape(61, 81), edits) - disparity.reshape(61, 81))
    assert change[30, 40] == pytest.approx(0.25 * 10, rel=0.01)
    y, x = np.mgrid[:61, :81]
    away = np.hypot(x - 40, y - 30)
    assert not change[away > 11].any()
    assert (change[away < 8] > 0).all()


@pytest.mark.parametrize("tool", BRUSH_TOOLS)
def test_a_stroke_does_not_cross_a_contour_and_changes_nothing_outside_the_photo(tool: BrushTool) -> None:
    photo, disparity = plain_photo(), plane()
    disparity[:, WIDTH // 2 :] += 3
    disparity[::2, : WIDTH // 2] += 0.5
    painted = apply_edits(photo, disparity, DepthEdits(strokes=(dab(tool, x=0.45),)))
    change = np.abs(painted - disparity)
    assert change[:, : WIDTH // 2].max() > 0.1
    assert not change[:, WIDTH // 2 :].any()
    if tool == "smooth":
        assert np.abs(np.diff(painted[10:20, 18], axis=0)).mean() < 0.4, "rows differ by 0.5"
    outside = tuple(dab(tool, *place) for place in ((-5.0, 0.5), (1e30, -1e30), (0.5, 40.0)))
    np.testing.assert_array_equal(apply_edits(photo, disparity, DepthEdits(strokes=outside)), disparity)


@pytest.mark.parametrize("tool", DEPTH_TOOLS)
def test_level_and_bucket_paint_the_depth_where_they_begin_or_another_place(tool: BrushTool) -> None:
    photo, disparity = plain_photo(), plane()
    for taken_from, at in ((None, int(0.3 * WIDTH)), ((0.9, 0.1), int(0.9 * WIDTH)), ((7.0, -2.0), WIDTH - 1)):
        stroke = replace(dab(tool, x=0.3, strength=1.0), taken_from=taken_from)
        result = apply_edits(photo, disparity, DepthEdits(strokes=(stroke,)))
        assert result[HEIGHT // 2, int(0.3 * WIDTH)] == pytest.approx(disparity[0, at], abs=0.02)
        np.testing.assert_array_equal(result[:, WIDTH // 2 :], disparity[:, WIDTH // 2 :])


places = st.tuples(st.floats(-0.2, 1.2), st.floats(-0.2, 1.2))
strokes = st.builds(
    Stroke,
    st.sampled_from(BRUSH_TOOLS),
    st.lists(places, min_size=1, max_size=4).map(tuple),
    st.floats(0.01, 0.25),
    st.floats(0, 1),
    st.none() | places,
)
edits = st.builds(
    lambda inverted, gamma, strokes: DepthEdits(inverted, gamma=gamma, strokes=tuple(strokes)),
    st.booleans(),
    st.sampled_from((0.5, 1.0)),
    st.lists(strokes, max_size=12),
)


@settings(max_examples=8)
@given(st.lists(edits, min_size=1, max_size=4))
def test_a_canvas_shows_the_same_whatever_it_showed_before(wanted: list[DepthEdits]) -> None:
    photo, last = tiled_photo(0, 0.3), UNEDITED
    canvas = DepthCanvas(photo, plane())
    for edit in wanted:
        *before, newest = edit.strokes or (dab(),)
        drawn = [replace(edit, strokes=(*before, replace(newest, points=newest.points[:n]))) for n in (1, 2)]
        for step in (*drawn, edit, replace(edit, strokes=tuple(before)), last):
            shown = canvas.apply(step)
            kept = shown.copy()
            np.testing.assert_array_equal(shown, apply_edits(photo, plane(), step))
            canvas.apply(edit)
            np.testing.assert_array_equal(shown, kept, "maps handed out must not change")
        last = edit


def test_a_canvas_continues_from_a_map_that_another_painted() -> None:
    photo, disparity = plain_photo(), plane()
    strokes = tuple(replace(dab(), points=((0.1 * k, 0.5),)) for k in range(1, 9))
    whole, part, other = (DepthEdits(gamma=2.0, strokes=strokes[:count]) for count in (8, 6, 5))
    canvas = DepthCanvas(photo, disparity)
    canvas.resume(part, apply_edits(photo, disparity, part))
    assert [canvas.strokes_ahead(edits) for edits in (whole, part, other)] == [2, 0, 5]
    assert canvas.strokes_ahead(replace(whole, gamma=1.0)) == 8
    for edits in (whole, other):
        np.testing.assert_array_equal(canvas.apply(edits), apply_edits(photo, disparity, edits))


@pytest.mark.parametrize("tool", BRUSH_TOOLS)
@pytest.mark.parametrize("shape", [(1, 1), (7, 1), (HEIGHT, WIDTH)])
@pytest.mark.parametrize("wild", [0.0, np.nan, 3e38])
def test_tiny_photos_and_wild_values_stay_finite(shape: tuple[int, int], tool: BrushTool, wild: float) -> None:
    photo, disparity = np.full((*shape, 3), 0.5, np.float32), np.zeros(shape, np.float32)
    disparity[1:20, 1:] = wild
    stroke = Stroke(tool, ((0.1, 0.1), (0.5, 0.5), (0.9, 0.9)), 0.25, 1.0)
    result = apply_edits(photo, disparity, DepthEdits(strokes=(stroke, stroke)))
    assert np.isfinite(result).all()
    assert wild or tool in ("smooth", *DEPTH_TOOLS) or result.any()


@pytest.mark.parametrize(("tool", "change"), [("forward", 0.3), ("back", -0.3)])
def test_a_surface_moves_as_a_whole_by_a_share_of_the_range(tool: BrushTool, change: float) -> None:
    photo, disparity = np.full((40, 60, 3), 0.3, np.float32), np.zeros((40, 60), np.float32)
    photo[10:30, 20:40] = 0.8
    disparity[10:30, 20:40] = np.linspace(4.0, 5.0, 20)
    disparity[:, 50:] = 10.0
    moved = apply_edits(photo, disparity, DepthEdits(strokes=(Stroke(tool, ((0.5, 0.5),), 0.02, 0.3),)))
    expected = disparity.copy()
    expected[10:30, 20:40] += 10 * change
    differs = np.abs(moved - expected) > 1e-5
    assert differs.sum() <= 4, "only its corners may belong to either side"
