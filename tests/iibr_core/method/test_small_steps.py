"""Steps of disparity too small to open a gap: pixels that show both surfaces move with the foreground."""

import numpy as np
import pytest
from iibr_core.generation.view_maker import ViewMaker

from iibr_core.evaluation.metrics import bounded_psnr
from iibr_core.evaluation.reference_warp import reference_warp
from iibr_core.method.mixed_pixels import move_with_foreground
from iibr_core.surfaces import SLOPE_SHARE
from iibr_core.types import ViewOffset

STEPS = (0.1, 1.0)


def moved(row, steps=STEPS):
    """Along a row of a picture, and the same along a column."""
    values = np.tile(np.float32(row), (3, 1))
    found = move_with_foreground(values, steps)
    np.testing.assert_array_equal(move_with_foreground(np.ascontiguousarray(values.T), steps), found.T)
    return found[1].tolist()


@pytest.mark.parametrize("step", [0.125, 0.5, 1.0])
def test_the_pixel_behind_a_step_moves_with_what_is_in_front(step):
    assert moved([0, 0, 0, step, step, step]) == [0, 0, step, step, step, step]
    assert moved([step, step, step, 0, 0, 0]) == [step, step, step, step, 0, 0]


@pytest.mark.parametrize("step", [0.0625, 1.25, np.inf, np.nan])
def test_smaller_and_larger_steps_stay(step):
    np.testing.assert_array_equal(moved([0, 0, 0, step, step, step]), np.float32([0, 0, 0, step, step, step]))


@pytest.mark.parametrize(
    "row",
    [
        np.linspace(0, 3, 10),
        np.linspace(3, 0, 10),
        [0, 0, 0, 0.5, 1.0, 1.0, 1.0],  # a ramp of two steps
        [0, 0, 0.25, 0.5, 0.75, 1.0, 1.0],
        0.4 * np.sin(np.arange(60) / 3),
    ],
)
def test_slopes_keep_their_bits(row):
    np.testing.assert_array_equal(moved(row), np.float32(row))


def test_pixels_move_as_the_slow_way_says():
    rng = np.random.default_rng(5)
    disparity = rng.choice(
        np.float32([0, 0.03, 0.3, 0.5, 0.9, 2, np.nan]), (23, 31), p=[0.5, 0.1, 0.1, 0.1, 0.1, 0.05, 0.05]
    )
    found, count = move_with_foreground(disparity, STEPS), 0
    for y, x in np.ndindex(disparity.shape):
        expected = slowly(disparity, y, x)
        np.testing.assert_equal(found[y, x], expected)
        count += expected > disparity[y, x]
    assert count > 50


def slowly(disparity, y, x):
    def at(v, u):
        return disparity[np.clip(v, 0, disparity.shape[0] - 1), np.clip(u, 0, disparity.shape[1] - 1)]

    ways = [(-1, 0), (0, -1), (0, 1), (1, 0)]
    beside = [(at(y + v, x + u), at(y + 2 * v, x + 2 * u)) for v, u in ways]
    known = [pair for pair in beside if not np.isnan(pair[0])]
    here = disparity[y, x]
    if not known or np.isnan(here):
        return here
    foreground = max(near for near, _ in known)
    beyond = next(far for near, far in known if near == foreground)
    step = foreground - here
    if not STEPS[0] < step <= STEPS[1]:
        return here
    falls_away = here - min(near for near, _ in known) > SLOPE_SHARE * step
    goes_on = beyond - foreground > SLOPE_SHARE * step
    return here if falls_away or goes_on else foreground


@pytest.mark.parametrize("parallax_px", [0.15, 0.3, 0.6, 0.9])
def test_views_of_small_steps_are_hardly_worse_than_a_plain_warp(parallax_px):
    """A disc before a wall, each pixel the mean of 8x8 points, seen from the four corners."""
    photo, disparity = disc(parallax_px, ViewOffset(0, 0))
    corners = [ViewOffset(t, s) for t in (-1, 1) for s in (-1, 1)]
    gains = []
    with ViewMaker(photo, disparity, corners, ("fast",)) as maker:
        for offset in corners:
            truth, plain = disc(parallax_px, offset)[0], reference_warp(photo, disparity, offset)
            made = maker.view("fast", offset).colors
            gains.append(bounded_psnr(made, truth, plain.visible) - bounded_psnr(plain.colors, truth, plain.visible))
    assert np.mean(gains) > -0.3


def disc(parallax_px, offset, size=48, points=8):
    """Its picture (H, W, 3) and disparity (H, W) from a viewpoint."""
    y, x = (np.mgrid[: size * points, : size * points] + 0.5) / points - 0.5
    own_y, own_x = y + parallax_px * offset.t, x + parallax_px * offset.s
    is_disc = (own_y - size / 2) ** 2 + (own_x - size / 2) ** 2 < (size / 3.3) ** 2
    wall = 0.75 + 0.05 * np.sin(x / 3) * np.sin(y / 4)
    shown = np.where(is_disc, 0.25 + 0.05 * np.sin(own_x / 4) * np.sin(own_y / 3), wall)
    picture = shown.reshape(size, points, size, points).mean((1, 3))
    centre = points // 2
    disparity = np.where(is_disc, parallax_px, 0.0)[centre::points, centre::points]
    return np.repeat(picture[..., None], 3, 2).astype(np.float32), disparity.astype(np.float32)
