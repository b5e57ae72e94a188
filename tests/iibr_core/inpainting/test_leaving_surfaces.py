"""Surfaces leave the frame along their outlines."""

import itertools
from math import exp

import numpy as np
import pytest

from iibr_core.inpainting.leaving_surfaces import (
    ALIKE,
    LEAST_PX,
    MOST_SLANT,
    NOTCH_PX,
    SPREAD_PX,
    STRAIGHT,
    TRACED_PX,
    _surface_slopes,
    _trace_outlines,
    _without_notches,
    follow_surfaces,
)
from iibr_core.types import ImageSize, Margins

MARGINS = Margins(6, 9, 7, 8)


def places_of(height, width):
    """Pixels (y, x) of the frame, clockwise from the upper left."""
    return (
        [(0, x) for x in range(width - 1)]
        + [(y, width - 1) for y in range(height - 1)]
        + [(height - 1, x) for x in range(width - 1, 0, -1)]
        + [(y, 0) for y in range(height - 1, 0, -1)]
    ) or [(0, 0)]


def surfaces_of(disparity, continued, margins):
    """The disparity (H', W') that goes on where; 0 inside."""
    height, width = disparity.shape
    along = np.array([disparity[at] for at in places_of(height, width)])
    surfaces = along[np.maximum(continued, 0)]
    surfaces[margins.top : margins.top + height, margins.left : margins.left + width] = 0
    return surfaces


def slopes_slowly(side, one_surface):
    """The same, one outline after the other."""
    length = side.shape[1]
    outlines = []
    for p in range(length - 1):
        here = side[0, p : p + 2]
        step = abs(here[1] - here[0])
        met = [p]
        for row in side[1:] if step > one_surface else ():
            near = [q for q in range(met[-1] - MOST_SLANT, met[-1] + MOST_SLANT + 1) if 0 <= q < length - 1]
            same = [q for q in near if (abs(row[q : q + 2] - here) < ALIKE * step).all()]
            if not same:
                break
            met.append(min(same, key=lambda q: (abs(q - met[-1]), -q)))
        if len(met) > LEAST_PX:
            k = np.arange(len(met))
            outlines.append((p, -(k * (np.array(met) - p)).sum() / (k**2).sum(), (len(met) - 1) / TRACED_PX))
    traced = {p for p, _, _ in outlines}
    steps = [p for p in range(length - 1) if abs(side[0, p + 1] - side[0, p]) > one_surface]
    lasting = np.arange(length)
    for p, after in itertools.pairwise(steps):
        if after - p <= NOTCH_PX and not {p, after} <= traced:
            lasting[p + 1 : after + 1] = lasting[p]
    slopes = np.zeros(length)
    for place in range(1, length - 1):
        shares = [(weight * exp(-abs(place - p) / SPREAD_PX), slope) for p, slope, weight in outlines]
        slopes[place] = sum(w * s for w, s in shares) / (sum(w for w, _ in shares) + STRAIGHT)
    return slopes, lasting


def follow_slowly(disparity, margins, one_surface):
    """Disparity around: of all that reaches a pixel from any side, the nearest."""
    nearest = np.full(margins.around(ImageSize(*disparity.shape)), -np.inf)
    for turn in range(4):
        side, around = np.rot90(disparity, turn), np.rot90(nearest, turn)
        far, before = ((margins.top, margins.left), (margins.right, margins.top), (margins.bottom, margins.right),
                       (margins.left, margins.bottom))[turn]  # fmt: skip
        slopes, lasting = slopes_slowly(side[: TRACED_PX + 1], one_surface)
        row_out, last = side[0][lasting], side.shape[1] - 1
        for row, column in np.ndindex(far, around.shape[1]):
            reach = np.arange(last + 1) + (far - row) * slopes
            x = column - before
            found = [row_out[0]] if x <= 0 else [row_out[last]] if x >= last else []
            for p in range(last):
                if reach[p] <= x <= reach[p + 1]:
                    found.append(row_out[p if x - reach[p] < reach[p + 1] - x else p + 1])
            around[row, column] = max([around[row, column], *found])
    nearest[np.isneginf(nearest)] = 0
    return nearest


@pytest.fixture
def two_outlines():
    """A post that leaves at a slant below and a roof that leaves to the right, before a rough wall."""
    y, x = np.indices((34, 46))
    disparity = np.random.default_rng(5).random((34, 46)) * 0.2
    disparity[abs(x - y / 2 - 8) < 3] += 4
    disparity[y < 30 - x / 3] += 2 * (x > 36)[y < 30 - x / 3]
    return disparity.astype(np.float32)


def test_slopes_against_the_definition(two_outlines):
    for turn in range(4):
        side = np.ascontiguousarray(np.rot90(two_outlines, turn)[: TRACED_PX + 1])
        outlines = _trace_outlines(side, 1.0)
        found = _surface_slopes(*outlines), _without_notches(side[0], outlines[1], 1.0)
        for of_kernel, expected in zip(found, slopes_slowly(side, 1.0)):
            np.testing.assert_allclose(of_kernel, expected, atol=1e-9)
    assert abs(found[0]).max() == 0  # no outline leaves to the left


def test_surfaces_against_the_definition(two_outlines):
    found = surfaces_of(two_outlines, follow_surfaces(two_outlines, MARGINS, 1.0), MARGINS)
    np.testing.assert_array_equal(found, follow_slowly(two_outlines, MARGINS, 1.0).astype(np.float32))


def test_a_slanted_post_goes_on_as_wide_as_it_is(two_outlines):
    found = surfaces_of(two_outlines, follow_surfaces(two_outlines, MARGINS, 1.0), MARGINS)
    for below in range(1, MARGINS.bottom + 1):
        post = np.flatnonzero(found[MARGINS.top + 33 + below] > 3) - MARGINS.left
        assert abs(post.mean() - (33 + below) / 2 - 8) <= 1
        assert 4 <= len(post) <= 7


def test_a_notch_at_the_frame_does_not_go_on():
    disparity = np.ones((20, 30), np.float32)
    disparity[-2:, 12:15] = 0.0
    disparity[-12:, 20:22] = 0.0
    found = surfaces_of(disparity, follow_surfaces(disparity, MARGINS, 0.5), MARGINS)
    np.testing.assert_array_equal(np.flatnonzero(found[-1] == 0) - MARGINS.left, [20, 21])


@pytest.mark.parametrize("width", [NOTCH_PX, NOTCH_PX + 1])
def test_what_is_wider_than_a_notch_goes_on_without_an_outline(width):
    disparity = np.ones((20, 30), np.float32)
    disparity[-2:, 12 : 12 + width] = 0.0
    found = surfaces_of(disparity, follow_surfaces(disparity, MARGINS, 0.5), MARGINS)
    assert (found[-1] == 0).sum() == (width if width > NOTCH_PX else 0)


def test_what_is_narrow_does_not_go_on_by_one_outline_alone():
    """A gap whose left side runs far into the photo, and whose right side ends with what stands there."""
    disparity = np.ones((20, 30), np.float32)
    disparity[-2:, 15:] = 2.0
    disparity[-12:, 12:15] = 0.0
    _, weights = _trace_outlines(np.ascontiguousarray(disparity[::-1][: TRACED_PX + 1]), 0.5)
    assert (weights[11] > 0, weights[14] > 0) == (True, False)
    found = surfaces_of(disparity, follow_surfaces(disparity, MARGINS, 0.5), MARGINS)
    assert set(found[-1]) == {1.0, 2.0}


@pytest.mark.parametrize("seed", range(4))
def test_blocks_against_the_definition(seed):
    """Many outlines, of which some meet, some end, some are notches, and some lie beside a corner."""
    rng = np.random.default_rng(seed)
    disparity = np.kron(rng.integers(0, 4, (7, 9)), np.ones((4, 3))) + rng.uniform(0, 0.1, (28, 27))
    disparity[rng.random((28, 27)) < 0.02] += 1
    disparity = disparity.astype(np.float32)
    found = surfaces_of(disparity, follow_surfaces(disparity, MARGINS, 0.5), MARGINS)
    np.testing.assert_array_equal(found, follow_slowly(disparity, MARGINS, 0.5).astype(np.float32))


def test_a_map_without_steps_goes_on_straight():
    disparity = np.add.outer(np.arange(12.0), np.arange(20.0)).astype(np.float32)
    found = surfaces_of(disparity, follow_surfaces(disparity, MARGINS, 2.0), MARGINS)
    expected = np.pad(disparity, ((6, 9), (7, 8)), "edge")
    expected[6:18, 7:27] = 0
    np.testing.assert_array_equal(found, expected)


@pytest.mark.parametrize("size", [(1, 1), (1, 6), (6, 1), (2, 2)], ids=str)
def test_tiny_maps(size):
    disparity = np.arange(size[0] * size[1], dtype=np.float32).reshape(size)
    found = surfaces_of(disparity, follow_surfaces(disparity, MARGINS, 0.5), MARGINS)
    np.testing.assert_array_equal(found, follow_slowly(disparity, MARGINS, 0.5).astype(np.float32))
