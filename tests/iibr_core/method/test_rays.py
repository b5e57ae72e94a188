import numpy as np
import pytest

from iibr_core.method.rays import CELL_PX, GUARD_BAND_PX, RaysBehind, RaySet, rays_of_photo
from iibr_core.method.update_loop import update
from iibr_core.method.view import Renderer
from iibr_core.surfaces import EDGE_PX, SAME_SURFACE_PX
from iibr_core.types import CENTRE, ImageSize, Margins, ViewOffset

FARTHEST = 2.0
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
    rows, columns = (range(0, side, CELL_PX) for side in values.shape)
    return np.array([[of_cell(values[y : y + CELL_PX, x : x + CELL_PX]) for x in columns] for y in rows])


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
    assert (rays.arrays.low[0] == slow_cells(np.where(coverage > 0, disparity, np.inf), np.min)).all()
    assert (rays.arrays.high[0] == slow_cells(np.where(coverage > 0, disparity, -np.inf), np.max)).all()
    assert rays.cell_steps == pytest.approx(slow_steps(disparity))


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
            top, left = max(y - GUARD_BAND_PX, 0), max(x - GUARD_BAND_PX, 0)
            expected[top : y + GUARD_BAND_PX + 1, left : x + GUARD_BAND_PX + 1] = 0
    np.testing.assert_array_equal(rays.arrays.coverage, [np.ones(size), coverage, expected])
    seen = np.where(expected > 0, made_up, np.float32(-np.inf))
    np.testing.assert_array_equal(rays.arrays.high[2], slow_cells(seen, np.max))
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


LEFT, RIGHT = ViewOffset(0.0, -2.0), ViewOffset(0.0, 2.0)


def test_what_was_inpainted_farther_back_does_not_show_through_a_hole_in_the_photos_surface():
    disparity = np.full((30, 40), 3.0, np.float32)
    disparity[:, 18:26] = 6.0
    card, pole, wall = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)
    colors = np.where(disparity[..., None] > 3, np.float32(pole), np.float32(card))
    rays, renderer = rays_of_photo(colors, disparity, 2.0, 2), Renderer()
    everywhere = np.ones_like(disparity)
    rays.add(LEFT, everywhere[..., None] * np.float32(wall), 0 * everywhere, everywhere)
    assert (renderer.render(rays, RIGHT).colors[15, 15:19] == wall).all()
    ((_, view),) = update(rays, [RIGHT], renderer)
    assert (view.occluded & view.inpainted)[15, 15:19].all()
    np.testing.assert_allclose(view.colors[15, 15:19], np.tile(np.float32(card), (4, 1)), atol=1e-5)
    np.testing.assert_array_equal(renderer.render(rays, RIGHT).colors[15, 15:19], view.colors[15, 15:19])
