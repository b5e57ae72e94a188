"""What a ray set keeps beside its rays, against slow twins."""

import numpy as np
import pytest

from iibr_core.method.rays import CELL_PX, GUARD_BAND_PX, RaysBehind, RaySet
from iibr_core.surfaces import EDGE_PX, SAME_SURFACE_PX, SMOOTH_SHARE
from iibr_core.types import ImageSize, Margins, ViewOffset

FARTHEST, CENTRE = 2.0, ViewOffset(0.0, 0.0)
SURFACE_STEP = SAME_SURFACE_PX / FARTHEST


def slow_near_edge(disparity):
    """Return where (H, W) it is near a pixel that differs from the one to its right or below, or is unknown: two pixels
    each way.
    """
    padded = np.pad(disparity, ((0, 1), (0, 1)), mode="edge")
    with np.errstate(invalid="ignore"):
        right, below = np.abs(padded[:-1, 1:] - disparity), np.abs(padded[1:, :-1] - disparity)
    is_step = ~((right <= SURFACE_STEP) & (below <= SURFACE_STEP))
    near = np.zeros_like(is_step)
    for y, x in np.argwhere(is_step):
        near[max(y - 2, 0) : y + 3, max(x - 2, 0) : x + 3] = True
    return near


def slow_cells(values, of_cell):
    """Return what of_cell makes of the pixels of each cell."""
    height, width = values.shape
    return np.array(
        [
            [of_cell(values[y : y + CELL_PX, x : x + CELL_PX]) for x in range(0, width, CELL_PX)]
            for y in range(0, height, CELL_PX)
        ]
    )


def slow_steps(disparity):
    """Return the largest step of each cell to pixels beside its own, inf beside unknown ones and at the border."""
    around = np.pad(disparity, 1, constant_values=np.nan)
    steps = [np.abs(np.roll(around, shift, axis)[1:-1, 1:-1] - disparity) for shift in (1, -1) for axis in (0, 1)]
    return slow_cells(np.nan_to_num(np.stack(steps).max(axis=0), nan=np.inf), np.max)


@pytest.mark.parametrize("size", [(19, 31), (1, 8), (8, 1), (1, 1)])
@pytest.mark.parametrize("unknown", [0.0, 0.05, 1.0])
def test_edges_and_cells(size, unknown):
    random = np.random.default_rng(1)
    disparity = np.cumsum(random.normal(0, 0.1, size), axis=1).astype(np.float32)
    disparity[random.random(size) < unknown] = np.nan
    coverage = np.where(np.isnan(disparity), 0, random.random(size) > 0.8).astype(np.float32)
    rays = RaySet(1, ImageSize(*size), FARTHEST)
    rays.add(CENTRE, np.zeros((*size, 3), np.float32), disparity, coverage)
    assert (rays.arrays.near_edge[0] == slow_near_edge(disparity)).all()
    assert (rays.cells.low[0] == slow_cells(np.where(coverage > 0, disparity, np.inf), np.min)).all()
    assert (rays.cells.high[0] == slow_cells(np.where(coverage > 0, disparity, -np.inf), np.max)).all()
    assert rays.cells.step == pytest.approx(slow_steps(disparity))


def test_in_nearer_views_larger_steps_are_smooth():
    rays = RaySet(0, ImageSize(8, 8), farthest_views=4.0)
    assert rays.smooth_step(ViewOffset(-4.0, 1.0)) == pytest.approx(SMOOTH_SHARE * SAME_SURFACE_PX / 4)
    assert rays.smooth_step(ViewOffset(1.0, 0.0)) == pytest.approx(SMOOTH_SHARE * SAME_SURFACE_PX)


@pytest.mark.parametrize("margins", [Margins(), Margins(3, 2, 0, 4)])
@pytest.mark.parametrize("seed", range(2, 5))
def test_what_was_made_up_in_front_of_what_the_photo_shows_is_left_out_and_what_is_beside_it(margins, seed):
    random, size, offset = np.random.default_rng(seed), ImageSize(20, 24), ViewOffset(-2.0, 1.0)
    photo, made_up = (random.uniform(low, low + 6, size).astype(np.float32) for low in (1.3, -3))
    coverage, black = (random.random(size) > 0.3).astype(np.float32), np.zeros((*size, 3), np.float32)
    rays = RaySet(3, size, FARTHEST, margins)
    rays.add(CENTRE, black, photo, np.ones(size, np.float32))
    rays.add(CENTRE, black, photo + 5, coverage)
    rays.add(offset, black, made_up, coverage)
    expected = coverage.copy()
    for y, x in np.argwhere(coverage > 0):
        d = made_up[y, x]
        v, u = round(y + d * offset.t), round(x + d * offset.s)
        if v in range(20) and u in range(24) and d > photo[v, u] + EDGE_PX / FARTHEST:
            expected[
                max(y - GUARD_BAND_PX, 0) : y + GUARD_BAND_PX + 1, max(x - GUARD_BAND_PX, 0) : x + GUARD_BAND_PX + 1
            ] = 0
    np.testing.assert_array_equal(rays.arrays.coverage, [np.ones(size), coverage, expected])
    np.testing.assert_array_equal(
        rays.cells.high[2], slow_cells(np.where(expected > 0, made_up, np.float32(-np.inf)), np.max)
    )
    assert 0 < expected.sum() < coverage.sum()


@pytest.mark.parametrize("margins", [Margins(), Margins(3, 2, 0, 4)])
def test_what_was_filled_in_a_view_joins_within_the_margins_with_what_lies_behind_instead(margins):
    random, size = np.random.default_rng(3), ImageSize(20, 24)
    view = ImageSize(size.height - margins.top - margins.bottom, size.width - margins.left - margins.right)
    colors, disparity = random.random((*view, 3), np.float32), random.random(view, np.float32)
    occluded, changed = random.random(view) > 0.7, random.random(view) > 0.9
    pixel = np.flatnonzero(changed)
    behind = RaysBehind(pixel, random.random((len(pixel), 3), np.float32), random.random(len(pixel), np.float32) - 2)
    given = [part.copy() for part in (colors, disparity, occluded)]
    rays = RaySet(2, size, margins=margins)
    rays.add(CENTRE, np.zeros((*size, 3), np.float32), np.full(size, 9, np.float32), np.ones(size, bool))
    rays.add(ViewOffset(1.0, 0.0), colors, disparity, occluded, behind=behind)
    np.testing.assert_equal([colors, disparity, occluded], given)
    colors[changed], disparity[changed] = behind.colors, behind.disparity
    for image, shown, around in (
        (rays.arrays.colors[1], colors, 0),
        (rays.arrays.disparity[1], disparity, np.nan),
        (rays.arrays.coverage[1], occluded | changed, 0),
    ):
        expected = np.full(image.shape, around, np.float32)
        rays.in_view(expected)[:] = shown
        np.testing.assert_array_equal(image, expected)
    assert (rays.photo_disparity == np.full(view, 9)).all()
