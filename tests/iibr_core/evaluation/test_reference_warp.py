"""The reference warp against slow loops; scale and shift; whether views agree."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.ndimage import gaussian_filter

from iibr_core.evaluation.alignment import fit_to_views
from iibr_core.evaluation.consistency import LineView, consistency, disagreement, line_straightness
from iibr_core.evaluation.metrics import psnr
from iibr_core.evaluation.scenes import warp_disparity
from iibr_core.evaluation.warp import LOBES, SAMPLES, reference_warp, reference_warp_to
from iibr_core.method.view import View
from iibr_core.types import ImageSize, ViewOffset
from tests.iibr_core.known_scenes import (
    FOREGROUND,
    HEIGHT,
    WALL,
    WIDTH,
    disparity_of_square,
    view_of_square,
    view_of_wall,
)
from tests.iibr_core.scenes import smooth_texture

CENTRE = ViewOffset(0.0, 0.0)


def slow_splat(disparity: np.ndarray, offset: ViewOffset) -> np.ndarray:
    """Nearest disparity that lands on each pixel of a map of flat surfaces; -inf where none does."""
    height, width = disparity.shape
    nearest = np.full((height, width), -np.inf)
    shifts = (np.arange(SAMPLES) + 0.5) / SAMPLES - 0.5
    for y in range(height):
        for x in range(width):
            d = disparity[y, x]
            for down in shifts:
                for across in shifts:
                    row = math.floor(y + down - d * offset.t + 0.5)
                    column = math.floor(x + across - d * offset.s + 0.5)
                    if 0 <= row < height and 0 <= column < width:
                        nearest[row, column] = max(nearest[row, column], d)
    return nearest


def slow_lanczos(photo: np.ndarray, y: float, x: float) -> np.ndarray:
    """Colour at one position, border repeated."""
    total, color = 0.0, np.zeros(3)
    for row in range(math.floor(y) - LOBES + 1, math.floor(y) + LOBES + 1):
        for column in range(math.floor(x) - LOBES + 1, math.floor(x) + LOBES + 1):
            w = np.sinc(y - row) * np.sinc((y - row) / LOBES) * np.sinc(x - column) * np.sinc((x - column) / LOBES)
            total += w
            color += w * photo[np.clip(row, 0, photo.shape[0] - 1), np.clip(column, 0, photo.shape[1] - 1)]
    return np.clip(color / total, 0, 1)


@pytest.mark.parametrize("offset", [ViewOffset(0.0, 1.0), ViewOffset(-2.0, 1.5), ViewOffset(0.7, -3.0)])
def test_the_warp_is_its_slow_twin(offset: ViewOffset) -> None:
    photo, disparity = smooth_texture(14, 17), np.full((14, 17), 0.5, np.float32)
    disparity[4:9, 5:11] = 2.0
    warped = reference_warp(photo, disparity, offset)
    nearest = slow_splat(disparity, offset)
    nearest[np.isinf(nearest)] = 1e9
    y, x = np.mgrid[0:14, 0:17]
    from_y, from_x = y + nearest * offset.t, x + nearest * offset.s
    inside = (from_x >= -0.5) & (from_x <= 16.5) & (from_y >= -0.5) & (from_y <= 13.5)
    np.testing.assert_array_equal(warped.hole, ~inside)
    for row, column in zip(*np.nonzero(~warped.hole)):
        assert warped.disparity[row, column] == nearest[row, column]
        wanted = slow_lanczos(photo, from_y[row, column], from_x[row, column])
        np.testing.assert_allclose(warped.colors[row, column], wanted, atol=1e-5)


def test_to_a_camera_with_half_as_large_pictures_it_is_the_photo_made_smaller() -> None:
    photo = smooth_texture(16, 20)
    smaller = np.diag([0.5, 0.5, 1.0, 1.0])  # pixel 2 x becomes pixel x
    warped = reference_warp_to(photo, np.ones((16, 20), np.float32), smaller, ImageSize(8, 10))
    assert not warped.hole.any()
    np.testing.assert_allclose(warped.colors, photo[::2, ::2], atol=1e-6)


def test_what_is_behind_a_camera_does_not_land() -> None:
    behind = np.diag([1.0, 1.0, -1.0, 1.0])
    warped = reference_warp_to(smooth_texture(6, 7), np.ones((6, 7), np.float32), behind, ImageSize(6, 7))
    assert warped.hole.all()
    assert np.isfinite(warped.colors).all()


def test_the_own_viewpoint_shows_the_photo() -> None:
    photo = smooth_texture(12, 15)
    warped = reference_warp(photo, np.random.default_rng(0).normal(0, 3, (12, 15)).astype(np.float32), CENTRE)
    assert not warped.hole.any()
    np.testing.assert_allclose(warped.colors, photo, atol=1e-6)


def test_holes_are_filled_from_behind_and_one_pixel_around_them_is_not_visible() -> None:
    photo, disparity = np.zeros((20, 30, 3), np.float32), np.zeros((20, 30), np.float32)
    photo[:] = (0.1, 0.2, 0.9)
    square = np.s_[5:15, 10:18]
    photo[square], disparity[square] = (0.9, 0.1, 0.1), 4.0
    warped = reference_warp(photo, disparity, ViewOffset(0.0, 1.0))
    assert warped.hole[5:15, 14:18].all()
    assert warped.hole.sum() == 40
    np.testing.assert_allclose(warped.colors[warped.hole], np.broadcast_to([0.1, 0.2, 0.9], (40, 3)), atol=1e-5)
    assert not warped.visible[4:16, 13:19].any()
    assert warped.visible[:3].all()


@pytest.mark.parametrize("shape", [(1, 1), (1, 9), (7, 1)])
@pytest.mark.parametrize("value", [np.nan, np.inf, 1e6, -1e6, 0.0])
def test_odd_disparities_give_finite_pictures(shape: tuple[int, int], value: float) -> None:
    photo = np.full((*shape, 3), 0.5, np.float32)
    warped = reference_warp(photo, np.full(shape, value, np.float32), ViewOffset(1.0, -1.0))
    assert np.isfinite(warped.colors).all()


def test_carried_disparity_is_that_of_the_other_view() -> None:
    at = ViewOffset(-1.0, 1.0)
    own = warp_disparity(disparity_of_square(), at)
    wanted = np.full((HEIGHT, WIDTH), WALL, np.float32)
    top, left = round(HEIGHT / 3 + FOREGROUND), round(WIDTH / 3 - FOREGROUND)
    wanted[top : top + HEIGHT // 3, left : left + WIDTH // 3] = FOREGROUND
    np.testing.assert_allclose(own, wanted, atol=1e-5)


def test_flat_and_unknown_maps_are_fitted_without_harm() -> None:
    estimate = np.ones((5, 6), np.float32)
    np.testing.assert_array_equal(fit_to_views(np.zeros((5, 6, 3), np.float32), estimate, []), estimate)


@pytest.mark.parametrize(("scale", "shift"), [(10.0, -3.0), (-4.0, 1.0)])
def test_views_tell_scale_and_shift(scale: float, shift: float) -> None:
    truth = disparity_of_square()
    estimate = (truth * np.float32(scale) + np.float32(shift)).astype(np.float32)
    offsets = [ViewOffset(t, s) for t in (-1.0, 1.0) for s in (-1.0, 1.0)]
    fitted = fit_to_views(view_of_square(CENTRE), estimate, [(at, view_of_square(at)) for at in offsets])
    assert np.abs(fitted - truth).max() < 0.2


@pytest.mark.parametrize("blur", [0.0, 1.0, 3.0])
def test_a_fit_never_takes_views_farther_from_the_true_ones(blur: float) -> None:
    """Small copies of sharp pictures, which the fit is found on, may say otherwise."""
    photo = np.random.default_rng(2).random((240, 320, 3)).astype(np.float32)
    truth = np.full((240, 320), 1.0, np.float32)
    truth[60:180, 100:220] = 4.0
    views = [(at, reference_warp(photo, truth, at).colors) for at in (ViewOffset(0.0, 2.0), ViewOffset(0.0, -2.0))]
    estimate = gaussian_filter(truth, blur)
    fitted = fit_to_views(photo, estimate, views)
    before, after = (
        np.mean([psnr(reference_warp(photo, disparity, at).colors, view) for at, view in views])
        for disparity in (estimate, fitted)
    )
    assert after >= before


def rendered(offset: ViewOffset, shift_px: float = 0.0, inpainted: bool = False) -> View:
    """The wall, perfectly seen; shift_px: moved to the right by mistake."""
    colors = view_of_wall(ViewOffset(offset.t, offset.s - shift_px / WALL))
    disparity = np.full((HEIGHT, WIDTH), WALL, np.float32)
    everywhere = np.full((HEIGHT, WIDTH), inpainted)
    return View(colors, disparity, everywhere, everywhere)


def test_views_of_one_wall_agree() -> None:
    corners = [ViewOffset(t, s) for t in (-2.0, 2.0) for s in (-2.0, 2.0)]
    wall = np.full((HEIGHT, WIDTH), WALL, np.float32)
    found = consistency(rendered, corners, view_of_wall(CENTRE), wall)
    assert found.surface_rms < 0.5
    assert found.line_rms < 0.5
    assert found.line_off_px < 0.02
    assert found.hole_pixels == 0
    assert math.isnan(found.hole_rms)
    holes = consistency(lambda at: rendered(at, inpainted=True), corners, view_of_wall(CENTRE), wall)
    assert holes.hole_rms == pytest.approx(found.surface_rms)
    assert holes.hole_pixels > 1000
    assert math.isnan(holes.surface_rms)


def test_content_that_differs_between_views_is_found() -> None:
    one, other = rendered(CENTRE), rendered(ViewOffset(0.0, 2.0))
    darker = View(other.colors - np.float32(10 / 255), other.disparity, other.occluded, other.inpainted)
    differences, in_hole = disagreement(one, darker, CENTRE, ViewOffset(0.0, 2.0))
    assert not in_hole.any()
    assert differences.mean() == pytest.approx(-10, abs=0.1)


@pytest.mark.parametrize("shift_px", [0.0, 0.1, -0.25])
def test_lines_that_are_not_straight_are_measured_in_pixels(shift_px: float) -> None:
    row = [
        LineView(s, rendered(ViewOffset(0.0, s), shift_px).colors, np.full((HEIGHT, WIDTH), WALL)) for s in (-2.0, 2.0)
    ]
    wall = np.full((HEIGHT, WIDTH), WALL, np.float32)
    rms, off_px = line_straightness(view_of_wall(CENTRE), wall, row)
    assert off_px == pytest.approx(abs(shift_px), abs=0.02)
    assert (rms > 0.3) == (shift_px != 0)


def test_hidden_points_are_no_part_of_a_line() -> None:
    photo, disparity, at = view_of_square(CENTRE), disparity_of_square(), ViewOffset(0.0, 2.0)
    warped = reference_warp(photo, disparity, at)
    rms, off_px = line_straightness(photo, disparity, [LineView(2.0, view_of_square(at), warped.disparity)])
    assert rms < 1
    assert off_px < 0.05
    assert psnr(photo, view_of_square(at)) < 30


def test_without_texture_or_views_nothing_is_told() -> None:
    flat = np.full((1, 9, 3), 0.5, np.float32)
    assert all(map(math.isnan, line_straightness(flat, np.zeros((1, 9), np.float32), [])))
    rms, off_px = line_straightness(flat, np.zeros((1, 9), np.float32), [LineView(1.0, flat, np.zeros((1, 9)))])
    assert rms == 0
    assert math.isnan(off_px)
