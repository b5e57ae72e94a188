"""What is said of a place of a map, and of all of it, is said of it turned, mirrored and with channels exchanged."""

from collections.abc import Callable

import numpy as np
import pytest
from iibr_core.depth.edges.edge_band import _find_between
from scipy.ndimage import gaussian_filter, maximum_filter

from iibr_core.depth.edges import edge_blur, edge_labels, edge_profiles, refine
from iibr_core.depth.edges.refine import refine as refine_map
from iibr_core.method.flying_pixels import measure_detail
from iibr_core.method.mixed_pixels import split_mixed_pixels
from iibr_core.stages import stages_without
from tests.iibr_core.scenes import smooth_texture

HEIGHT, WIDTH, SIGMA, EDGE = 44, 60, 1.5, 0.3
TURNS = {
    "left and right": lambda values: values[:, ::-1],
    "up and down": lambda values: values[::-1],
    "rows and columns": lambda values: values.swapaxes(0, 1),
}
NO_FIT = stages_without(["fit-to-blur"])
SHARES, TAPS = np.empty(edge_profiles.SHARES), np.empty(edge_profiles.SHARES)


def things():
    """Which of five things each pixel of a map shows: a wall, a box, a disc and two wires, one of them aslant."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    thing = np.zeros((HEIGHT, WIDTH), int)
    thing[8:20, 6:24] = 1
    thing[(y - 30) ** 2 + (x - 42) ** 2 < 81] = 2
    thing[:, 30:33], thing[abs(x - y - 8) < 2] = 3, 4
    return thing


def scene():
    """A photo (H, W, 3) of these and their map (H, W), on slants, blurred."""
    y, x = np.mgrid[:HEIGHT, :WIDTH]
    thing = things()
    heights = np.float32([0, 2, 1.2, 3, 2.5])[thing] + 0.004 * x - 0.006 * y
    colors = np.float32([(0.2, 0.3, 0.5), (0.8, 0.4, 0.2), (0.3, 0.7, 0.3), (0.9, 0.9, 0.2), (0.6, 0.1, 0.6)])[thing]
    photo = colors + np.random.default_rng(1).normal(0, 0.02, colors.shape)
    return photo.astype(np.float32), gaussian_filter(heights, SIGMA, mode="nearest").astype(np.float32)


def feet(values, x, y, across, down, sign=1.0):
    return edge_profiles._feet(values, x, y, across, down, sign, 12, EDGE)


PLACES: dict[str, Callable[..., object]] = {
    "height": lambda v, p, x, y, a, d: edge_profiles.height_at(v, x + 0.3 * a, y + 0.3 * d),
    "inside": lambda v, p, x, y, a, d: edge_profiles.is_inside(v, x + 9 * a, y + 9 * d),
    "passes": lambda v, p, x, y, a, d: edge_profiles.passes(v, x, y, a, d, 1.0, 7.0, 1.0, 0.9),
    "gradient": lambda v, p, x, y, a, d: np.dot(edge_profiles.gradient(v, int(x), int(y)), (a, d)),
    "walk": lambda v, p, x, y, a, d: edge_profiles.walk(v, x, y, a, d, 1.0, 8, 1.0, 3.0),
    "change": lambda v, p, x, y, a, d: edge_profiles.strongest_change(p, x, y, a, d, -4.0, 5.0),
    "flat shoulders": lambda v, p, x, y, a, d: edge_blur._has_flat_shoulders(v, x, y, a, d, 0.0, SIGMA, 0.4),
    "photo": lambda v, p, x, y, a, d: edge_blur._photo_agrees(p, x, y, a, d, 0.13, SIGMA),
    "continued": lambda v, p, x, y, a, d: refine._continued(v, x, y, a, d, 4.0, SIGMA, 0.7, 0.2),
    "step": lambda v, p, x, y, a, d: refine._as_step(v, int(x), int(y), a, d, SIGMA, EDGE),
    "color": lambda v, p, x, y, a, d: edge_profiles._color_at(p, x + 0.3 * a, y + 0.3 * d),
    "crest": lambda v, p, x, y, a, d: edge_profiles._crest(v, x, y, a, d, 1.0),
    "feet": lambda v, p, x, y, a, d: feet(v, x, y, a, d),
    "relief": lambda v, p, x, y, a, d: edge_profiles._is_relief(v, x, y, a, d, (3.0, 4.0), 1.0, 9.0),
    "shares": lambda v, p, x, y, a, d: edge_profiles._structure_shares(p, x, y, a, d, (5.0, 6.0), 9.0, SHARES),
    "structure": lambda v, p, x, y, a, d: edge_profiles.structure_at(
        v, p, int(x), int(y), a, d, 0.5, 1.0, SIGMA, EDGE, SHARES, TAPS
    ),
    "blur of a structure": lambda v, p, x, y, a, d: edge_profiles.structure_blur(
        v, p, x, y, a, d, 1.0, EDGE, SHARES, TAPS
    )[:2],
}


@pytest.mark.parametrize("what", PLACES)
def test_a_place_along_a_turned_line_is_as_before(what):
    photo, values = scene()
    rng = np.random.default_rng(2)
    at = np.argwhere(np.hypot(*np.gradient(values)) > 0.02)
    places = at[rng.choice(len(at), 150, replace=False)]
    ways = [(1.0, 0.0), (0.6, 0.8), (-0.8, 0.6), (0.0, -1.0)]
    seen = set()
    for name, turn in TURNS.items():
        turned_photo, turned_values = (np.ascontiguousarray(turn(image)) for image in (photo, values))
        for k, (y, x) in enumerate(places.astype(float)):
            across, down = ways[k % 4]
            before = PLACES[what](values, photo, x, y, across, down)
            to = {
                "left and right": (WIDTH - 1 - x, y, -across, down),
                "up and down": (x, HEIGHT - 1 - y, across, -down),
                "rows and columns": (y, x, down, across),
            }[name]
            after = PLACES[what](turned_values, turned_photo, *to)
            np.testing.assert_allclose(after, before, atol=2e-4, equal_nan=True)
            seen.add(str(before))
    assert len(seen) > 1, "it depends on the place"


BOTH_WAYS: dict[str, Callable[..., object]] = {
    "change": lambda v, p, x, y, a, d, way: edge_profiles.strongest_change(
        p, x, y, a, d, *((-4.0, 5.0) if way > 0 else (-5.0, 4.0))
    ),
    "flat shoulders": lambda v, p, x, y, a, d, way: edge_blur._has_flat_shoulders(v, x, y, a, d, 0.4 * way, SIGMA, 0.4),
    "photo": lambda v, p, x, y, a, d, way: edge_blur._photo_agrees(p, x, y, a, d, 0.13 * way, SIGMA),
    "crest": lambda v, p, x, y, a, d, way: way * edge_profiles._crest(v, x, y, a, d, 1.0),
    "feet": lambda v, p, x, y, a, d, way: feet(v, x, y, a, d)[:: int(way)],
    "slit": lambda v, p, x, y, a, d, way: feet(-v, x, y, a, d, -1.0)[:: int(way)],
    "relief": lambda v, p, x, y, a, d, way: edge_profiles._is_relief(v, x, y, a, d, (3.0, 4.0)[:: int(way)], 1.0, 9.0),
    "structure": lambda v, p, x, y, a, d, way: edge_profiles.structure_at(
        v, p, int(x), int(y), a, d, 0.6 * way, 1.0, SIGMA, EDGE, SHARES, TAPS
    )[:2],
    "blur of a structure": lambda v, p, x, y, a, d, way: edge_profiles.structure_blur(
        v, p, x, y, a, d, 1.0, EDGE, SHARES, TAPS
    )[:2],
}


@pytest.mark.parametrize("what", BOTH_WAYS)
def test_a_line_is_alike_from_both_ends(what):
    photo, values = scene()
    seen = set()
    at = np.argwhere(np.hypot(*np.gradient(values)) > 0.02)[::7].astype(float)
    for k, (y, x) in enumerate(at):
        across, down = [(1.0, 0.0), (0.6, 0.8), (-0.8, 0.6), (0.0, -1.0)][k % 4]
        one, other = (BOTH_WAYS[what](values, photo, x, y, way * across, way * down, way) for way in (1.0, -1.0))
        np.testing.assert_allclose(other, one, atol=2e-4)
        seen.add(str(one))
    assert len(seen) > 1, "it depends on the place"


@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS)
def test_a_turned_map_is_refined_alike(turn):
    """But for ties. Edges that the fit to the blur moves one after the other are left out."""
    photo, values = scene()
    dilated = maximum_filter(np.float32([0, 2, 1.2, 3, 2.5])[things()], 3)
    for given in (values, dilated):
        expected = turn(refine_map(photo, given, stages=NO_FIT))
        found = refine_map(np.ascontiguousarray(turn(photo)), np.ascontiguousarray(turn(given)), stages=NO_FIT)
        assert (abs(found - expected) > 0.05).mean() < 0.02
        assert (abs(expected - turn(given)) > 0.05).mean() > 0.02, "something is refined"


@pytest.mark.parametrize("turn", TURNS.values(), ids=TURNS)
def test_what_lies_between_surfaces_does_so_however_they_are_turned(turn):
    """Bands of one and two pixels, on both sides of vertical, level and slanted edges."""
    rng = np.random.default_rng(3)
    values = np.float32([0, 9, 4])[things() % 3]
    between = rng.random(values.shape) < 0.1
    values[between] = rng.uniform(0, 9, between.sum())
    found, clear = _find_between(values, EDGE)
    again, clear_again = _find_between(np.ascontiguousarray(turn(values)), EDGE)
    np.testing.assert_array_equal(again, turn(found))
    assert clear == clear_again > 5


@pytest.mark.parametrize("height", [-64.0, 64.0])
def test_a_raised_map_is_as_before(height):
    rng = np.random.default_rng(3)
    values = np.float32([0, 2, 1.25, 3, 2.5])[things()]
    between = rng.random(values.shape) < 0.1
    values[between] = rng.integers(0, 48, between.sum()) / 16
    raised = values + np.float32(height)
    found, clear = _find_between(values, EDGE)
    again, clear_again = _find_between(raised, EDGE)
    np.testing.assert_array_equal(again, found)
    assert clear == clear_again > 5
    np.testing.assert_array_equal(edge_labels.step_distance(raised, EDGE), edge_labels.step_distance(values, EDGE))
    photo, soft = scene()
    for given in (maximum_filter(np.float32([0, 2, 1.25, 3, 2.5])[things()], 3), soft):
        expected = refine_map(photo, given)
        assert (abs(refine_map(photo, given + np.float32(height)) - height - expected) > 0.02).mean() < 0.01
        assert (expected != given).mean() > 0.02


def grey_in_one_channel(photo, channel):
    """Its brightness in one channel, nothing in the others."""
    shown = np.full_like(photo, 0.5)
    shown[..., channel] = photo.mean(axis=2)
    return shown


@pytest.mark.parametrize("channel", [1, 2])
def test_all_channels_count_alike(channel):
    photo, soft = scene()
    photo += 0.1 * smooth_texture(HEIGHT, WIDTH)
    exact = np.float32([0, 2, 1.2, 3, 2.5])[things()]
    first, other = grey_in_one_channel(photo, 0), grey_in_one_channel(photo, channel)
    for given in (soft, maximum_filter(exact, 3)):
        expected = refine_map(first, given)
        np.testing.assert_allclose(refine_map(other, given), expected, atol=1e-5)
        assert (expected != given).any()
    np.testing.assert_array_equal(measure_detail(other), measure_detail(first))
    split, expected = split_mixed_pixels(other, exact, EDGE), split_mixed_pixels(first, exact, EDGE)
    np.testing.assert_allclose(split[3], expected[3], atol=1e-5)
    np.testing.assert_allclose(split[0][..., channel], expected[0][..., 0], atol=1e-5)
    assert (expected[3] > 0).sum() > 50


@pytest.mark.parametrize(
    ("row", "is_step"),
    [
        ([0, 0, 1, 1], True),
        ([0, 1, 2, 3], False),
        ([0, 0.3, 1.3, 1.6], False),
        ([0, 0.2, 1.2, 1.5], True),
        ([0, 0.3, 1.3, 1.5], True),
        ([1, 0, 1, 2], True),
        ([0, 1, 2, 1], True),
        ([1, 0, 1, 0], True),
    ],
)
def test_a_step_that_goes_on_likewise_before_and_after_it_is_a_slope(row, is_step):
    """The middle one of three, upwards and downwards, along rows and columns; 0.3 of it is enough, 0.2 is not."""
    for values in (np.float32(row), -np.float32(row)):
        rows = np.tile(values, (5, 1))
        for turned, step in ((rows, (2, 1, 2, 2)), (np.ascontiguousarray(rows.T), (1, 2, 2, 2))):
            assert edge_labels._is_slope(turned, *step, values[2] - values[1]) != is_step
