from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from iibr_core.depth.editing.bucket import surface_at
from iibr_core.depth.editing.canvas import DepthCanvas, apply_edits
from iibr_core.depth.editing.edits import (
    BRUSH_TOOLS,
    DEPTH_TOOLS,
    UNEDITED,
    DepthEdits,
    Patch,
    Stroke,
    apply_tone,
    extent_of,
    invert_tone_curve,
    levels_of,
    require_sound,
    tone_curve,
)
from iibr_core.types import InputError

shares = st.floats(0, 1)
tones = st.builds(
    lambda inverted, clips, gamma: DepthEdits(inverted, min(clips), max(clips), gamma),
    st.booleans(),
    st.just((0.0, 1.0)) | st.tuples(shares, shares),
    st.floats(0.25, 4),
)


def slow_toned(value: float, low: float, high: float, edits: DepthEdits) -> float:
    share = (value - low) / (high - low)
    if edits.is_inverted:
        share = 1 - share
    if edits.far_clip > 0:
        share = max(share, edits.far_clip)
    if edits.near_clip < 1:
        share = min(share, edits.near_clip)
    if 0 <= share <= 1:
        share = share**edits.gamma
    elif share > 1:
        share = 1 + edits.gamma * (share - 1)
    return low + share * (high - low)


@given(tones, st.integers(0, 1000))
def test_tone_is_its_slow_twin_at_every_pixel(edits, seed) -> None:
    disparity = np.random.default_rng(seed).normal(0, 3, (7, 9)).astype(np.float32)
    low, high = extent_of(disparity)
    wanted = [slow_toned(float(value), low, high, edits) for value in disparity.flat]
    np.testing.assert_allclose(apply_tone(disparity, edits).flat, wanted, rtol=1e-5, atol=1e-5)
    bent = DepthEdits(gamma=edits.gamma)
    for share in (-0.5, 0.0, 0.3, 1.0, 1.5):
        assert invert_tone_curve(tone_curve(share, bent), bent) == pytest.approx(share)


def test_the_extent_leaves_wild_values_out_and_a_flat_map_has_one_too() -> None:
    disparity = np.random.default_rng(0).uniform(-1, 1, (100, 100)).astype(np.float32)
    disparity[3, 3] = 1e6
    low, high = extent_of(disparity)
    assert -1 <= low < high <= 1
    low, high = extent_of(np.full((10, 200), 3.0, np.float32))
    assert (low, high) == (2.0, 4.0)
    levels = levels_of(np.float32([[-9, 0, 0.1, 0.9, 1, np.nan, 7]]), (0.0, 1.0))
    assert (levels.low, levels.high, sum(levels.counts)) == (0, 1, 6)
    assert [at for at, count in enumerate(levels.counts) for _ in range(count)] == [0, 0, 6, 57, 63, 63]
    for shape in ((0, 0), (0, 5), (2, 3)):
        with pytest.raises(InputError, match="no disparity is known"):
            extent_of(np.full(shape, np.nan, np.float32))


@pytest.mark.parametrize(
    "edits",
    [
        DepthEdits(gamma=np.nan),
        DepthEdits(far_clip=0.6, near_clip=0.5),
        DepthEdits(strokes=(Stroke("nearer", (), 0.1, 0.5),)),
        DepthEdits(strokes=(Stroke("carve", ((0.5, 0.5),), 0.1, 0.5),)),
        DepthEdits(strokes=(Stroke("nearer", ((0.5, np.inf),), 0.1, 0.5),)),
        DepthEdits(strokes=(Stroke("back", ((0.5, 0.5),), 0.1, 0.5, patches=(Patch((), 0.1),)),)),
        DepthEdits(strokes=(Stroke("back", ((0.5, 0.5),), 0.1, 0.5, feather=np.inf),)),
    ],
)
def test_edits_that_make_no_sense_are_refused(edits) -> None:
    with pytest.raises(InputError, match="depth edits"):
        require_sound(edits)


HEIGHT, WIDTH = 30, 40


def plain_photo(left: float = 0.3, right: float = 0.7) -> np.ndarray:
    photo = np.full((HEIGHT, WIDTH, 3), left, np.float32)
    photo[:, WIDTH // 2 :] = right
    return photo


def plane() -> np.ndarray:
    """A disparity that rises from left to right, 0 to 1."""
    return np.tile(np.linspace(0, 1, WIDTH, dtype=np.float32), (HEIGHT, 1))


def dab(tool="nearer", x=0.4, y=0.5, radius=0.2, strength=0.5):
    return Stroke(tool, ((x, y),), radius, strength)


@pytest.mark.parametrize("tool", BRUSH_TOOLS)
def test_a_stroke_is_as_wide_in_a_tall_photo_as_in_a_wide_one(tool) -> None:
    disparity = np.random.default_rng(0).random((120, WIDTH), np.float32)
    tall, middle = (
        apply_edits(np.full((*part.shape, 3), 0.5, np.float32), part, DepthEdits(strokes=(dab(tool, 0.51, 0.5, 0.05),)))
        for part in (disparity, disparity[40:80])
    )
    np.testing.assert_allclose(tall[40:80], middle, atol=1e-3)


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
def test_a_canvas_shows_the_same_whatever_it_showed_before(wanted) -> None:
    tiles = np.random.default_rng(0).uniform(0, 0.3, (HEIGHT // 5, WIDTH // 5, 3)).astype(np.float32)
    photo, last = tiles.repeat(5, 0).repeat(5, 1), UNEDITED
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
def test_tiny_photos_and_wild_values_stay_finite(shape, tool, wild) -> None:
    photo, disparity = np.full((*shape, 3), 0.5, np.float32), np.zeros(shape, np.float32)
    disparity[1:20, 1:] = wild
    stroke = Stroke(tool, ((0.1, 0.1), (0.5, 0.5), (0.9, 0.9)), 0.25, 1.0)
    result = apply_edits(photo, disparity, DepthEdits(strokes=(stroke, stroke)))
    assert np.isfinite(result).all()
    assert wild or tool in ("smooth", *DEPTH_TOOLS) or result.any()


ROWS, COLUMNS = 60, 80


def grey_photo(color: float = 0.4) -> np.ndarray:
    return np.full((ROWS, COLUMNS, 3), color, np.float32)


def filled(photo, x=0.1, y=0.5, radius=0.03, disparity=None, **changes):
    disparity = np.zeros(photo.shape[:2], np.float32) if disparity is None else disparity
    return surface_at(photo, disparity, Stroke("fill", ((x, y),), radius, 1.0, **changes), 0, (0.0, 1.0))


def test_soft_shades_are_one_until_they_turn_into_another_colour() -> None:
    shade = np.linspace(0.1, 0.9, COLUMNS, dtype=np.float32)
    photo = np.broadcast_to(shade[:, None], (ROWS, COLUMNS, 3))
    assert filled(0.3 + photo / 4, disparity=np.tile(shade, (ROWS, 1))).all()
    mask = filled(photo.copy())
    assert mask[:, :10].all()
    assert not mask[:, COLUMNS // 2 :].any()


def test_gaps_texture_and_small_holes_are_no_edges_and_large_holes_are() -> None:
    photo = grey_photo(0.3)
    photo[:, ::2] = 0.6
    photo[:, 60:] = [0.1, 0.9, 0.1]
    assert filled(photo, radius=0.1)[:, :58].all(), "texture under the brush"
    assert not filled(photo, radius=0.1)[:, 60:].any()
    photo = grey_photo()
    photo[10:13, 40:43] = photo[30:45, 40:60] = 0.9
    assert filled(photo)[:25].all(), "smaller than the brush"
    assert not filled(photo)[32:43, 42:58].any()
    photo = grey_photo()
    photo[:, 38:42] = 0.9
    photo[30:33, 38:42] = 0.4
    mask = filled(photo)
    assert mask[:, :34].all(), "its mouth is as near to edges as the gap itself"
    assert not mask[:, 42:].any()


def test_thin_surfaces_give_something() -> None:
    photo = grey_photo()
    photo[:, 40:43] = 0.9
    assert all(filled(photo, *place).any() for place in ((0.5, 0.5), (0.51, 0.1)))
