"""Strokes: their reach against a slow search of shortest ways, contours, and a canvas that forgets nothing."""

from __future__ import annotations

import heapq
from dataclasses import replace
from math import ceil, floor, hypot

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from iibr_core.depth.editing.canvas import MAPS_KEPT, DepthCanvas, _blend, _move, apply_edits
from iibr_core.depth.editing.edits import BRUSH_TOOLS, DEPTH_TOOLS, UNEDITED, BrushTool, DepthEdits, Stroke
from iibr_core.depth.editing.smoothing import smooth_within_contours
from iibr_core.depth.editing.stroke_distance import (
    CONTOUR_CONTRAST,
    HALF_UP_PX,
    SAME,
    _measure,
    falloff,
    stroke_distance,
)
from iibr_core.depth.editing.surface import _find_edges
from iibr_core.depth.editing.touched_colors import (
    CUBES,
    GUIDE_STEPS,
    LIKENESS,
    UNSEEN,
    guide_of,
    mark_unlike,
    stroke_colours,
    unlikeness,
)
from iibr_core.runtime.work import Cancelled, stoppable
from iibr_core.types import InputError

HEIGHT, WIDTH = 30, 40


def plain_photo(left: float = 0.3, right: float = 0.7) -> np.ndarray:
    """Two areas, parted by a contour in the middle."""
    photo = np.full((HEIGHT, WIDTH, 3), left, np.float32)
    photo[:, WIDTH // 2 :] = right
    return photo


def plane() -> np.ndarray:
    """A disparity that rises from left to right, 0 to 1."""
    return np.tile(np.linspace(0, 1, WIDTH, dtype=np.float32), (HEIGHT, 1))


def dab(
    tool: BrushTool = "nearer", x: float = 0.4, y: float = 0.5, radius: float = 0.2, strength: float = 0.5
) -> Stroke:
    return Stroke(tool, ((x, y),), radius, strength)


def slow_distance(photo: np.ndarray, stroke: Stroke) -> np.ndarray:
    """Point by point, Dijkstra over all pixels from those under the way to it."""
    distance = np.ones(photo.shape[:2])
    for index in range(len(stroke.points)):
        slow_step(photo, stroke, index, distance)
    return distance


def slow_step(photo: np.ndarray, stroke: Stroke, index: int, distance: np.ndarray) -> None:
    height, width = photo.shape[:2]
    ends = [np.array((x * width - 0.5, y * height - 0.5)) for x, y in stroke.points[max(index - 1, 0) : index + 1]]
    radius, waiting = stroke.radius * width, []
    for share in np.linspace(0, 1, max(ceil(2 * np.hypot(*(ends[-1] - ends[0]))), 1) + 1):
        x, y = ends[0] + share * (ends[-1] - ends[0])
        row, column = floor(y + HALF_UP_PX + 0.5), floor(x + HALF_UP_PX + 0.5)
        seed = hypot(column - x, row - y) / radius
        if seed < distance[row, column] - SAME:
            distance[row, column] = seed
            waiting.append((seed, row, column))
    heapq.heapify(waiting)
    guide = guide_of(photo)
    photo, colors = guide[1:-1, 1:-1] / GUIDE_STEPS, stroke_colours(guide, stroke, index).T / GUIDE_STEPS
    away = np.linalg.norm(photo[:, :, None] - colors, axis=3).min(axis=2)
    unlike = np.maximum(away - LIKENESS, 0)  # of blocks of 5 x 5: there are none but at the window's border
    while waiting:
        here, row, column = heapq.heappop(waiting)
        if here > distance[row, column]:
            continue
        for down in (-1, 0, 1):
            for across in (-1, 0, 1):
                other = row + down, column + across
                if other == (row, column) or not (0 <= other[0] < height and 0 <= other[1] < width):
                    continue
                length = hypot(down, across)
                way = here + length / radius + max(unlike[other] - unlike[row, column], 0) / CONTOUR_CONTRAST
                if way < distance[other]:
                    distance[other] = way
                    heapq.heappush(waiting, (way, *other))


def test_painting_stops_between_strokes_and_goes_on_there() -> None:
    photo, disparity = np.zeros((HEIGHT, WIDTH, 3), np.float32), np.zeros((HEIGHT, WIDTH), np.float32)
    strokes = tuple(replace(dab(), points=((0.05 * k, 0.5),)) for k in range(20))
    edits, asked = DepthEdits(strokes=strokes), iter([False] * 3 + [True])
    canvas = DepthCanvas(photo, disparity)
    with pytest.raises(Cancelled), stoppable(lambda: next(asked)):
        canvas.apply(edits)
    assert canvas.strokes_ahead(edits) == 17
    assert np.array_equal(canvas.apply(edits), apply_edits(photo, disparity, edits))
    assert canvas.strokes_ahead(edits) == 0


@given(st.integers(0, 1000))
@settings(max_examples=10)
def test_many_strokes_at_once_are_the_same_as_one_by_one(seed: int) -> None:
    rng = np.random.default_rng(seed)
    photo = rng.uniform(0, 1, (HEIGHT // 5, WIDTH // 5, 3)).repeat(5, 0).repeat(5, 1).astype(np.float32)
    disparity = rng.uniform(-1, 1, (HEIGHT, WIDTH)).astype(np.float32)
    strokes = tuple(
        Stroke(BRUSH_TOOLS[rng.integers(5)], tuple(map(tuple, rng.uniform(-0.1, 1.1, (2, 2)).tolist())), 0.15, 0.5)
        for _ in range(3 * MAPS_KEPT)
    )
    canvas = DepthCanvas(photo, disparity)
    for count in range(len(strokes) + 1):
        before = canvas.apply(DepthEdits(strokes=strokes[:count]))
    kept = before.copy()
    at_once = DepthCanvas(photo, disparity)
    at_once.apply(DepthEdits(strokes=strokes[:3]))
    assert np.array_equal(at_once.apply(DepthEdits(strokes=strokes)), before)
    canvas.apply(DepthEdits(strokes=strokes * 2))
    assert np.array_equal(before, kept)


def test_a_canvas_goes_on_from_a_map_that_another_painted() -> None:
    photo, disparity = np.zeros((HEIGHT, WIDTH, 3), np.float32), np.zeros((HEIGHT, WIDTH), np.float32)
    strokes = tuple(replace(dab(), points=((0.1 * k, 0.5),)) for k in range(1, 9))
    whole, part, other = (DepthEdits(gamma=2.0, strokes=those) for those in (strokes, strokes[:6], strokes[:5]))
    canvas = DepthCanvas(photo, disparity)
    canvas.resume(part, apply_edits(photo, disparity, part))
    assert [canvas.strokes_ahead(edits) for edits in (whole, part, other)] == [2, 0, 5]
    assert canvas.strokes_ahead(replace(whole, gamma=1.0)) == 8
    for edits in (whole, other):
        assert np.array_equal(canvas.apply(edits), apply_edits(photo, disparity, edits))


@settings(max_examples=30)
@example(0, 0.25, [(0.5, 0.21875), (0.125, 0.75)])
@example(1, 0.125, [(0.5, 0.2193173144942801), (0.5, 0.5), (0.5, 0.2193173144942801)])
@given(
    st.integers(0, 1000),
    st.floats(0.05, 0.25),
    st.lists(st.tuples(st.floats(0.1, 0.9), st.floats(0.1, 0.9)), min_size=1, max_size=4),
)
def test_distances_are_shortest_ways(seed: int, radius: float, points: list[tuple[float, float]]) -> None:
    rng = np.random.default_rng(seed)
    photo = rng.uniform(0, 0.4, (HEIGHT // 5, WIDTH // 5, 3)).repeat(5, 0).repeat(5, 1).astype(np.float32)
    stroke = replace(dab(radius=radius), points=tuple(points))
    np.testing.assert_allclose(stroke_distance(guide_of(photo), stroke), slow_distance(photo, stroke), atol=1e-5)


@pytest.mark.parametrize(("least", "most", "colors"), [(0.0, 1.0, 30), (-2.0, 20.0, 30), (0.3, 0.5, 1), (0.0, 1.0, 0)])
def test_cubes_of_colours_tell_of_a_pixel_what_its_own_colour_does(least: float, most: float, colors: int) -> None:
    rng = np.random.default_rng(colors)
    photo = rng.uniform(least, most, (HEIGHT, WIDTH, 3)).astype(np.float32)
    photo[::2] = photo[0, 0]  # the same cube, again and again
    guide, chosen = guide_of(photo), rng.integers(0, HEIGHT * WIDTH, colors)
    touched = np.ascontiguousarray(guide[1:-1, 1:-1].reshape(-1, 3)[chosen].T, np.int32) + np.int32(40)
    marks, cubes = np.full((HEIGHT + 2, WIDTH + 2), 7, np.uint8), np.full(CUBES, UNSEEN)
    for y in range(1, HEIGHT + 1):
        mark_unlike(guide, touched, cubes, y, 1, WIDTH + 1, marks)
    wanted = [[unlikeness(*guide[y, x], touched) > 0 for x in range(1, WIDTH + 1)] for y in range(1, HEIGHT + 1)]
    np.testing.assert_array_equal(marks[1:-1, 1:-1], wanted)
    assert (marks[[0, -1]] == 7).all()


@pytest.mark.parametrize(("tool", "sign"), [("nearer", 1), ("farther", -1)])
def test_a_dab_moves_its_middle_by_its_strength_and_ends_at_its_radius(tool: BrushTool, sign: int) -> None:
    photo = np.full((61, 81, 3), 0.5, np.float32)
    disparity = np.linspace(0, 10, 61 * 81, dtype=np.float32).reshape(61, 81)
    stroke = Stroke(tool, ((0.5, 0.5),), 10 / 81, 0.25)
    change = apply_edits(photo, disparity, DepthEdits(strokes=(stroke,))) - disparity
    assert change[30, 40] == pytest.approx(sign * 0.25 * 10, rel=0.01)
    y, x = np.mgrid[:61, :81]
    away = np.hypot(x - 40, y - 30)
    assert not change[away > 11].any()
    assert (sign * change[away < 8] > 0).all()
    assert abs(change[30, 45]) == pytest.approx(abs(change[30, 40]) * (1 - 0.5**2) ** 2, rel=0.01)


@pytest.mark.parametrize("tool", BRUSH_TOOLS)
def test_a_stroke_does_not_cross_a_contour(tool: BrushTool) -> None:
    photo, disparity = plain_photo(), plane()
    disparity[:, WIDTH // 2 :] += 3
    disparity[::2, : WIDTH // 2] += 0.5
    change = apply_edits(photo, disparity, DepthEdits(strokes=(dab(tool, x=0.45),))) - disparity
    assert np.abs(change[:, : WIDTH // 2]).max() > 0.1
    assert not change[:, WIDTH // 2 :].any()


def test_noise_is_no_contour() -> None:
    rng = np.random.default_rng(0)
    photo = np.clip(0.5 + rng.normal(0, 0.005, (HEIGHT, WIDTH, 3)), 0, 1).astype(np.float32)
    plain = stroke_distance(guide_of(np.full_like(photo, 0.5)), dab())
    assert np.abs(falloff(stroke_distance(guide_of(photo), dab())) - falloff(plain)).max() < 0.15


def test_texture_that_the_stroke_runs_over_does_not_stop_it() -> None:
    photo = plain_photo(0.9, 0.9)
    photo[:, : WIDTH // 2 : 2] = 0.1
    photo[:, 1 : WIDTH // 2 : 2] = 0.4
    near = falloff(stroke_distance(guide_of(photo), dab(x=0.25)))
    plain = falloff(stroke_distance(guide_of(np.full_like(photo, 0.5)), dab(x=0.25)))
    np.testing.assert_allclose(near[:, : WIDTH // 2], plain[:, : WIDTH // 2], atol=1e-5)
    assert not near[:, WIDTH // 2 :].any()


def test_smoothing_is_its_slow_twin_along_a_row_and_keeps_a_constant() -> None:
    rng = np.random.default_rng(1)
    photo, values = plain_photo(), rng.normal(size=(HEIGHT, WIDTH)).astype(np.float32)
    smooth = smooth_within_contours(photo, values, 5.0, 0.0)
    for part in (np.s_[:, : WIDTH // 2], np.s_[:, WIDTH // 2 :]):
        assert smooth[part].std() < 0.3 * values[part].std()
        assert smooth[part].mean() == pytest.approx(values[part].mean(), abs=0.1)
    constant = np.full_like(values, 2.5)
    np.testing.assert_allclose(smooth_within_contours(photo, constant, 5.0, 0.0), constant, rtol=1e-6)


def test_smoothing_does_not_mix_what_a_contour_parts() -> None:
    values = np.zeros((HEIGHT, WIDTH), np.float32)
    values[:, WIDTH // 2 :] = 1
    np.testing.assert_allclose(smooth_within_contours(plain_photo(), values, 8.0, 0.0), values, atol=0.02)


strokes = st.builds(
    Stroke,
    st.sampled_from(BRUSH_TOOLS),
    st.lists(st.tuples(st.floats(-0.2, 1.2), st.floats(-0.2, 1.2)), min_size=1, max_size=4).map(tuple),
    st.floats(0.01, 0.25),
    st.floats(0, 1),
    st.none() | st.tuples(st.floats(-0.2, 1.2), st.floats(-0.2, 1.2)),
)
edits = st.builds(
    lambda inverted, gamma, strokes: DepthEdits(inverted, gamma=gamma, strokes=tuple(strokes)),
    st.booleans(),
    st.sampled_from((0.5, 1.0)),
    st.lists(strokes, max_size=3),
)


def begun(wanted: DepthEdits, points: int) -> DepthEdits:
    """The same with no more points in the last stroke."""
    if not wanted.strokes:
        return wanted
    last = wanted.strokes[-1]
    short = replace(last, points=last.points[:points])
    return DepthEdits(wanted.is_inverted, gamma=wanted.gamma, strokes=(*wanted.strokes[:-1], short))


@settings(max_examples=30)
@given(st.lists(edits, min_size=1, max_size=4), st.randoms())
def test_a_canvas_shows_the_same_whatever_it_showed_before(wanted: list[DepthEdits], random: object) -> None:
    rng = np.random.default_rng(0)
    photo = rng.uniform(0, 0.3, (HEIGHT // 5, WIDTH // 5, 3)).repeat(5, 0).repeat(5, 1).astype(np.float32)
    canvas = DepthCanvas(photo, plane())
    for one in wanted:
        steps = [
            begun(one, 1),
            begun(one, 2),
            one,
            DepthEdits(one.is_inverted, gamma=one.gamma, strokes=one.strokes[:-1]),
        ]
        for step in steps:
            shown = canvas.apply(step)
            before = shown.copy()
            np.testing.assert_array_equal(shown, apply_edits(photo, plane(), step))
            canvas.apply(one)
            np.testing.assert_array_equal(shown, before, "what was handed out must not change")


@pytest.mark.parametrize("tool", DEPTH_TOOLS)
def test_level_and_bucket_lead_to_the_depth_where_they_begin_or_to_one_taken_elsewhere(tool: BrushTool) -> None:
    photo, disparity = plain_photo(), plane()
    for taken_from, at in ((None, int(0.3 * WIDTH)), ((0.9, 0.1), int(0.9 * WIDTH)), ((7.0, -2.0), WIDTH - 1)):
        stroke = replace(dab(tool, x=0.3, strength=1.0), taken_from=taken_from)
        result = apply_edits(photo, disparity, DepthEdits(strokes=(stroke,)))
        assert result[HEIGHT // 2, int(0.3 * WIDTH)] == pytest.approx(disparity[0, at], abs=0.02)
        np.testing.assert_array_equal(result[:, WIDTH // 2 :], disparity[:, WIDTH // 2 :])


def test_the_bucket_fills_the_whole_surface_and_as_far_as_its_strength() -> None:
    photo, disparity = plain_photo(), plane()
    stroke = replace(dab("fill", x=0.1, radius=0.05, strength=0.5), taken_from=(0.9, 0.5))
    result = apply_edits(photo, disparity, DepthEdits(strokes=(stroke,)))
    half_way = (disparity + disparity[0, int(0.9 * WIDTH)]) / 2
    np.testing.assert_allclose(result[:, : WIDTH // 2], half_way[:, : WIDTH // 2], atol=1e-6)
    np.testing.assert_array_equal(result[:, WIDTH // 2 :], disparity[:, WIDTH // 2 :])


def test_dragged_over_an_edge_the_bucket_fills_both_sides() -> None:
    stroke = Stroke("fill", ((0.2, 0.5), (0.8, 0.5)), 0.05, 1.0)
    result = apply_edits(plain_photo(), plane(), DepthEdits(strokes=(stroke,)))
    np.testing.assert_array_equal(result, np.full_like(result, result[0, 0]))


def test_the_map_before_strokes_is_not_painted() -> None:
    photo, disparity = plain_photo(), plane()
    canvas = DepthCanvas(photo, disparity)
    np.testing.assert_array_equal(canvas.before_strokes(DepthEdits(strokes=(dab(),))), disparity)
    canvas.apply(DepthEdits(gamma=2.0))
    np.testing.assert_array_equal(canvas.before_strokes(DepthEdits()), disparity)
    assert canvas.apply(UNEDITED) is disparity


@pytest.mark.parametrize("tool", BRUSH_TOOLS)
@pytest.mark.parametrize("shape", [(1, 1), (1, 7), (7, 1), (3, 2)])
def test_tiny_photos_can_be_painted_on(shape: tuple[int, int], tool: BrushTool) -> None:
    photo, disparity = np.full((*shape, 3), 0.5, np.float32), np.zeros(shape, np.float32)
    result = apply_edits(photo, disparity, DepthEdits(strokes=(dab(tool, 0.5, 0.5, 0.25),)))
    assert np.isfinite(result).all()
    assert tool in ("smooth", *DEPTH_TOOLS) or result.any()


@pytest.mark.parametrize("tool", BRUSH_TOOLS)
@pytest.mark.parametrize("wild", [np.nan, np.inf, -np.inf, 3e38, -3e38])
def test_wild_values_stay_finite(wild: float, tool: BrushTool) -> None:
    disparity = plane()
    disparity[10:20, 10:30] = wild
    stroke = Stroke(tool, ((0.1, 0.1), (0.9, 0.9)), 0.2, 1.0)
    assert np.isfinite(apply_edits(plain_photo(), disparity, DepthEdits(strokes=(stroke, stroke)))).all()


@pytest.mark.parametrize("place", [(-5.0, 0.5), (1e30, -1e30), (0.5, 40.0)])
def test_a_stroke_outside_the_photo_changes_nothing(place: tuple[float, float]) -> None:
    disparity = plane()
    result = apply_edits(plain_photo(), disparity, DepthEdits(strokes=(Stroke("nearer", (place,), 0.1, 1.0),)))
    np.testing.assert_array_equal(result, disparity)


def test_sizes_must_agree_and_something_must_be_known() -> None:
    with pytest.raises(ValueError, match="disparity"):
        DepthCanvas(plain_photo(), np.zeros((3, 3), np.float32))
    with pytest.raises(InputError, match="no disparity is known"):
        apply_edits(plain_photo(), np.full((HEIGHT, WIDTH), np.nan, np.float32), DepthEdits(strokes=(dab(),)))


def test_strokes_of_all_sizes_need_the_kernels_that_were_prepared() -> None:
    for shape, radius in (((4, 4), 0.1), ((HEIGHT, WIDTH), 0.05), ((HEIGHT, 3), 0.25)):
        photo, disparity = np.full((*shape, 3), 0.5, np.float32), np.zeros(shape, np.float32)
        for tool in BRUSH_TOOLS:
            apply_edits(photo, disparity, DepthEdits(strokes=(dab(tool, radius=radius),)))
    for kernel in (_move, _blend, _measure, _find_edges):
        assert len(kernel.signatures) == 1, kernel
