import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import map_coordinates

from iibr_core.evaluation.alignment import ViewFit, Warp
from iibr_core.evaluation.consistency import consistency, disagreement
from iibr_core.evaluation.warp import SAMPLES, reference_warp, reference_warp_to
from iibr_core.method.view import View
from iibr_core.types import CENTRE, FloatImage, ImageSize, ViewOffset
from tests.iibr_core.known_scenes import HEIGHT, WALL, WIDTH, disparity_of_square, view_of_square, view_of_wall
from tests.iibr_core.scenes import smooth_texture


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


@pytest.mark.parametrize("offset", [ViewOffset(0.0, 1.0), ViewOffset(-2.0, 1.5), ViewOffset(0.7, -3.0)])
def test_the_warp_is_its_slow_twin(offset) -> None:
    photo, disparity = smooth_texture(14, 17), np.full((14, 17), 0.5, np.float32)
    disparity[4:9, 5:11] = 2.0
    warped = reference_warp(photo, disparity, offset)
    nearest = slow_splat(disparity, offset)
    nearest[np.isinf(nearest)] = 1e9
    y, x = np.mgrid[0:14, 0:17]
    from_y, from_x = y + nearest * offset.t, x + nearest * offset.s
    inside = (from_x >= -0.5) & (from_x <= 16.5) & (from_y >= -0.5) & (from_y <= 13.5)
    np.testing.assert_array_equal(warped.hole, ~inside)
    np.testing.assert_array_equal(warped.disparity[inside], nearest[inside])
    for c in range(3):
        wanted = map_coordinates(photo[..., c], [from_y[inside], from_x[inside]], order=3, mode="nearest")
        np.testing.assert_allclose(warped.colors[inside, c], np.clip(wanted, 0, 1), atol=1e-5)


def test_to_a_camera_with_half_as_large_pictures_it_is_the_photo_made_smaller() -> None:
    photo = smooth_texture(16, 20)
    smaller = np.diag([0.5, 0.5, 1.0, 1.0])  # pixel 2 x becomes pixel x
    warped = reference_warp_to(photo, np.ones((16, 20), np.float32), smaller, ImageSize(8, 10))
    assert not warped.hole.any()
    np.testing.assert_allclose(warped.colors, photo[::2, ::2], atol=1e-6)
    behind = np.diag([1.0, 1.0, -1.0, 1.0])
    assert reference_warp_to(photo, np.ones((16, 20), np.float32), behind, ImageSize(16, 20)).hole.all()


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


def fit_of(photo: FloatImage, views: Sequence[tuple[ViewOffset, FloatImage]]) -> ViewFit:
    def warp_to(offset: ViewOffset) -> Warp:
        return lambda colors, disparity: reference_warp(colors, disparity, offset).colors

    farthest = max((abs(part) for at, _ in views for part in at))
    return ViewFit(photo, [(warp_to(at), view) for at, view in views], farthest)


@pytest.mark.parametrize(("scale", "shift"), [(10.0, -3.0), (-4.0, 1.0)])
def test_a_known_scale_and_shift_are_found(scale, shift) -> None:
    truth = disparity_of_square()
    estimate = (truth * np.float32(scale) + np.float32(shift)).astype(np.float32)
    views = [(ViewOffset(t, s), view_of_square(ViewOffset(t, s))) for t, s in ((-1.0, 1.0), (1.0, -1.0))]
    fitted = fit_of(view_of_square(CENTRE), views).fitted(estimate)
    assert np.abs(fitted - truth).max() < 0.2


@pytest.mark.parametrize("disparity", [WALL, -1.7])
def test_the_plane_of_a_wall_is_found(disparity) -> None:
    views = [(at, view_of_wall(at, disparity)) for at in (ViewOffset(0.0, 2.0), ViewOffset(-2.0, 0.0))]
    fit = fit_of(view_of_wall(CENTRE), views)
    assert fit.plane == pytest.approx(disparity, abs=0.02)
    np.testing.assert_allclose(fit.fitted(np.full((HEIGHT, WIDTH), 7, np.float32)), fit.plane)


def rendered(offset: ViewOffset, is_inpainted: bool = True) -> View:
    everywhere = np.full((HEIGHT, WIDTH), is_inpainted)
    return View(view_of_wall(offset), np.full((HEIGHT, WIDTH), WALL, np.float32), everywhere, everywhere)


def test_views_of_one_wall_agree() -> None:
    corners = [ViewOffset(t, s) for t in (-2.0, 2.0) for s in (-2.0, 2.0)]
    assert consistency(rendered, corners) < 0.5
    assert math.isnan(consistency(lambda at: rendered(at, is_inpainted=False), corners))
    assert math.isnan(consistency(rendered, []))
    one, other = rendered(CENTRE), rendered(ViewOffset(0.0, 2.0))
    darker = replace(other, colors=other.colors - np.float32(10 / 255))
    assert disagreement(one, darker, CENTRE, ViewOffset(0.0, 2.0)).mean() == pytest.approx(-10, abs=0.1)
