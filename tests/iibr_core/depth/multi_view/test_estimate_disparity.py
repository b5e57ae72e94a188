"""Disparity from several views: right on scenes whose truth is known, finite on everything else."""

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from iibr_core.color import bytes_from_encoded
from iibr_core.depth.multi_view.estimate_disparity import (
    REFINING_WORK,
    estimate_coarse,
    estimate_disparity,
    map_work,
    sweep_bytes,
    sweep_steps,
)
from iibr_core.depth.multi_view.guided_filter import GuidedFilter
from iibr_core.depth.multi_view.matching import (
    COST_STEPS,
    HIDDEN_FACTOR,
    MOST_COST,
    _match,
    _store_costs,
    choose_views,
    luma_of,
    matching_views,
    sweep,
)
from iibr_core.depth.multi_view.semi_global import choose_disparity
from iibr_core.runtime.work import Cancelled, stoppable, watched
from iibr_core.training.scenes.random_scene import random_scene
from iibr_core.training.scenes.raycast import render
from iibr_core.types import (
    GridShape,
    ImageSize,
    InputError,
    ViewOffset,
)
from tests.iibr_core.scenes import smooth_texture

GRID = GridShape(5, 5)
OFFSETS = [GRID.offset(*at) for at in np.ndindex(*GRID)]
CENTRE = 12


def whole(views, offsets=OFFSETS, reference=CENTRE):
    return estimate_disparity(views, offsets, reference, estimate_coarse(views, offsets, reference).range_px)


def slanted_views(slope, offsets=OFFSETS, size=(80, 96)):
    """Views of a plane whose disparity grows by `slope` px a column, drawn exactly: a sum of sines. And its truth."""
    y, x = np.mgrid[: size[0], : size[1]].astype(np.float64)
    waves = np.random.default_rng(2).uniform(-1.2, 1.2, (24, 2))
    phases = np.random.default_rng(3).uniform(0, 6.28, 24)

    def view(offset):
        # A view's pixel at x shows what the centre view has at from_x, where from_x - d(from_x) s = x.
        from_x = (x - slope * (size[1] / 2) * offset.s) / (1 - slope * offset.s)
        d = slope * (from_x - size[1] / 2)
        waved = sum(np.sin(a * from_x + b * (y + d * offset.t) + p) for (a, b), p in zip(waves, phases))
        return bytes_from_encoded(np.repeat((0.5 + 0.06 * waved)[..., None], 3, -1).astype(np.float32))

    return [view(offset) for offset in offsets], slope * (x - size[1] / 2)


@pytest.mark.parametrize("slope", [0.0, 0.02, -0.03])
def test_a_slanted_plane_comes_back_to_a_fiftieth_of_a_pixel(slope):
    views, truth = slanted_views(slope)
    error = np.abs(whole(views) - truth)[8:-8, 8:-8]
    assert np.median(error) < 0.02
    assert np.quantile(error, 0.95) < 0.07


def test_two_views_beside_each_other_are_enough():
    pair = [ViewOffset(0.0, 0.0), ViewOffset(0.0, 1.0)]
    views, truth = slanted_views(0.05, pair)
    error = np.abs(whole(views, pair, 0) - truth)[8:-8, 8:-8]
    assert np.quantile(error, 0.9) < 0.15


def test_of_a_pair_what_one_view_alone_sees_takes_what_looks_like_it_around():
    """A bright square, 8 px nearer than a dark wall: the wall to its left is hidden in the other view."""
    rng = np.random.default_rng(8)
    wall, square = (np.kron(rng.integers(*levels, (40, 52)), np.ones((2, 2))) for levels in ((0, 90), (160, 250)))
    views = []
    for at in (40, 32):
        view = wall.copy()
        view[20:60, at : at + 30] = square[20:60, 40:70]
        views.append(np.repeat(view[..., None], 3, -1).astype(np.uint8))
    pair = [ViewOffset(0.0, 0.0), ViewOffset(0.0, 1.0)]
    found = estimate_disparity(views, pair, 0, (-2.0, 12.0))
    assert np.median(np.abs(found[24:56, 32:36])) < 1.5  # 5.3 where it is matched like the rest
    assert np.abs(found[24:56, 44:66] - 8).max() < 1


def test_procedural_scenes_with_hidden_parts_come_out_mostly_right():
    size = ImageSize(120, 140)
    scene = random_scene(np.random.default_rng(5), size, 2.5)
    drawn = [render(scene, size, offset, samples=2) for offset in OFFSETS]
    found = whole([bytes_from_encoded(colors) for colors, _ in drawn])
    error = np.abs(found - drawn[CENTRE][1])[8:-8, 8:-8]
    assert np.mean(error > 0.2) < 0.12


def test_light_that_grows_from_view_to_view_does_not_mislead():
    views, truth = slanted_views(0.02)
    waves = np.sin(np.mgrid[:80, :96][1] / 15)[..., None]
    shaded = [
        np.clip(view + 12 * waves * offset.s + 8 * offset.t, 0, 255).astype(np.uint8)
        for view, offset in zip(views, OFFSETS)
    ]
    error = np.abs(whole(shaded) - truth)[8:-8, 8:-8]
    assert np.median(error) < 0.11  # 0.15 where the luma itself is matched


@pytest.mark.parametrize("value", [0, 255])
def test_views_without_any_texture_give_something_finite(value):
    assert np.isfinite(whole([np.full((40, 50, 3), value, np.uint8)] * 25)).all()


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 6e4])
def test_wild_colours_of_hdr_views_give_something_finite(value):
    views = [(view / np.float16(255)).astype(np.float16) for view in slanted_views(0.02)[0]]
    for view in views:
        view[20:30, 40:50] = value
    assert np.isfinite(whole(views)).all()


def test_what_cannot_be_matched_is_refused_in_words():
    with pytest.raises(InputError, match="too small"):
        estimate_coarse([np.zeros((1, 40, 3), np.uint8)] * 2, [ViewOffset(0.0, 0.0), ViewOffset(0.0, 1.0)], 0)
    with pytest.raises(InputError, match="the same viewpoint"):
        estimate_coarse([np.zeros((20, 40, 3), np.uint8)] * 2, [ViewOffset(0.0, 0.0)] * 2, 0)
    with pytest.raises(ValueError, match="cannot be matched"):
        matching_views([np.zeros((4, 4), np.float32), np.zeros((4, 5), np.float32)], OFFSETS[:2])


def test_it_stops_when_asked():
    with pytest.raises(Cancelled), stoppable(lambda: True):
        estimate_coarse(slanted_views(0.0)[0], OFFSETS, CENTRE)


def test_a_sweep_is_least_where_the_surface_is():
    views, _ = slanted_views(0.0, size=(40, 40))
    some = (12, 11, 13, 7, 17)
    matched = matching_views([luma_of(views[index]) for index in some], [OFFSETS[index] for index in some])
    disparities = np.linspace(-2, 2, 9, dtype=np.float32)
    costs = sweep(matched, disparities)
    assert (costs[8:-8, 8:-8].argmin(-1) == 4).mean() > 0.97
    values, sureness = choose_disparity(costs, matched.luma, disparities)
    assert np.abs(values[8:-8, 8:-8]).max() < 0.1
    assert sureness[8:-8, 8:-8].min() > 0.5


def test_a_sweep_costs_nothing_where_views_are_alike_and_all_there_is_where_nothing_matches():
    one, other = (np.random.default_rng(seed).random((24, 30)).astype(np.float32) for seed in (1, 2))
    offsets = [ViewOffset(0.0, 0.0), ViewOffset(0.0, 1.0)]
    alike, unlike = (sweep(matching_views([one, view], offsets), np.float32([0.0]))[..., 0] for view in (one, other))
    assert alike.max() == 0
    assert np.median(unlike) > 200


def test_what_half_of_the_views_match_much_better_counts_as_hidden_in_the_rest():
    """Slow and plain: the root of the whole's mean, or of the best half's where that is so many times better."""
    parts = (1e-3 * np.random.default_rng(3).random((5, 6, 8))).astype(np.float32)
    parts[4] = parts[:4].mean(axis=0)
    found = np.empty((6, 8), np.uint8)
    _store_costs(parts, np.float32(MOST_COST**2), found)
    cost = np.minimum(parts[4], HIDDEN_FACTOR * parts[:4].min(axis=0))
    expected = COST_STEPS * np.minimum(np.sqrt(cost / MOST_COST**2), 1)
    assert (parts[4] < HIDDEN_FACTOR * parts[:4].min(axis=0)).any()
    assert np.abs(found - np.floor(expected)).max() <= 1
    # Where halves match alike, the whole counts.
    _store_costs(np.full((5, 6, 8), 0.25 * MOST_COST**2, np.float32), np.float32(MOST_COST**2), found)
    assert np.abs(found - 0.5 * COST_STEPS).max() <= 1


def test_one_disparity_leaves_no_choice():
    values, _ = choose_disparity(np.full((3, 4, 1), 7, np.uint8), np.zeros((3, 4), np.float32), np.float32([1.5]))
    assert (values == 1.5).all()


def test_views_on_eight_rays_are_matched_and_few_are_all_taken():
    chosen = choose_views([GridShape(9, 9).offset(*at) for at in np.ndindex(9, 9)], 40)
    assert chosen[0] == 40
    assert len(chosen) == len(set(chosen)) == 33
    assert choose_views([ViewOffset(0.0, 0.0), ViewOffset(2.0, 1.0), ViewOffset(1.0, 2.0)], 1) == [1, 2, 0]


def test_more_is_foretold_for_more_pixels_and_more_disparities():
    few, more = sweep_bytes((100, 100), (-1, 1), 4), sweep_bytes((100, 100), (-2, 2), 4)
    assert few < more < sweep_bytes((200, 100), (-2, 2), 4)


def test_the_guided_filter_is_what_its_paper_says():
    """A slow twin: every window's line fitted by itself, then the means of all windows about a pixel."""
    guide, image = smooth_texture(9, 11)[..., 0].copy(), smooth_texture(9, 11, 4)[..., 1].copy()
    radius, smoothness = 2, 1e-3
    slopes, bases = np.empty_like(guide), np.empty_like(guide)

    def window(values, y, x):
        return values[max(y - radius, 0) : y + radius + 1, max(x - radius, 0) : x + radius + 1].astype(np.float64)

    for y, x in np.ndindex(*guide.shape):
        g, p = window(guide, y, x), window(image, y, x)
        slopes[y, x] = (np.mean(g * p) - g.mean() * p.mean()) / (g.var() + smoothness)
        bases[y, x] = p.mean() - slopes[y, x] * g.mean()
    expected = [window(slopes, *at).mean() * guide[at] + window(bases, *at).mean() for at in np.ndindex(*guide.shape)]
    filtered = image.copy()
    GuidedFilter(guide, radius, smoothness).apply(filtered)
    np.testing.assert_allclose(filtered.ravel(), expected, atol=2e-4)


@pytest.mark.parametrize("disparity", [0.0, 0.4, -1.25, 3.0])
def test_matching_is_what_its_slow_twin_says(disparity):
    """Every pixel by itself: its place in each view, the four pixels around that, the mean of each side's views."""
    rng = np.random.default_rng(1)
    textures = rng.normal(0, 0.02, (9, 7, 8)).astype(np.float32)
    offsets = np.float32([(0, 0), (0, 1), (0, -1), (1, 0), (-1, 0), (1, 1), (-1, -1), (1, -1), (-2, 2)])
    most = 9e-4
    found = np.empty((5, 7, 8), np.float32)
    _match(textures, offsets, np.float32(disparity), np.float32(most), found)
    for y, x in np.ndindex(7, 8):
        costs = []
        for texture, (t, s) in zip(textures[1:], offsets[1:]):
            row, column = y - disparity * t, x - disparity * s
            if 0 <= row <= 6 and 0 <= column <= 7:
                there = map_coordinates(texture.astype(np.float64), [[row], [column]], order=1)[0]
                costs.append((t, s, min((there - textures[0, y, x]) ** 2, most)))
        everything = np.mean([cost for *_, cost in costs]) if len(costs) >= 0.3 * 8 else most
        sides = (lambda t, s: s < 0, lambda t, s: s > 0, lambda t, s: t < 0, lambda t, s: t > 0)
        halves = [[cost for t, s, cost in costs if is_there(t, s)] for is_there in sides]
        expected = [np.mean(half) if half and len(costs) >= 0.3 * 8 else everything for half in halves]
        np.testing.assert_allclose(found[:, y, x], [*expected, everything], rtol=1e-4, atol=1e-8)


@pytest.mark.parametrize(("offsets", "sweeps"), [(OFFSETS, 1), ([ViewOffset(0.0, 0.0), ViewOffset(0.0, 1.0)], 2)])
def test_progress_counts_the_sweep_and_what_follows_it(offsets, sweeps):
    views, _ = slanted_views(0.01, offsets)
    range_px, told = (-1.0, 1.0), []
    reference = len(offsets) // 2 if sweeps == 1 else 0
    with watched(lambda *now: told.append(now)):
        estimate_disparity(views, offsets, reference, range_px)
    steps = sweep_steps(range_px, 2.0 if sweeps == 1 else 1.0) + 1
    done, totals, _ = zip(*told)
    assert set(totals) == {map_work(steps, len(offsets))}
    assert done[:steps] == tuple(range(1, steps + 1))
    assert done[-1] == pytest.approx(totals[0] - REFINING_WORK)
    assert len(told) == sweeps * (steps + 1)
