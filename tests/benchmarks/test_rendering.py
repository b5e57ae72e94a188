"""The renderer's bench: its best picture against slow twins, and figures of a small field."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.speed.rendering import (
    APERTURE_VARIANTS,
    BETWEEN,
    PINHOLE_VARIANTS,
    best_pictures,
    measure_drawing,
    shear_light,
    shift_image,
)
from benchmarks.speed.variants import BenchScene
from iibr_core.evaluation.metrics import psnr
from iibr_core.types import ViewOffset
from tests.iibr_core.known_scenes import disparity_of_square, offsets_of, view_of_square
from viewer.gpu.context import GLContext
from viewer.model.state.optics import Optics


@pytest.fixture(scope="module")
def scene() -> BenchScene:
    field = tuple(offsets_of(5, 5).values())
    return BenchScene("square", view_of_square(ViewOffset(0.0, 0.0)), disparity_of_square(), {}, field)


def quiet(done: float, total: float, doing: str) -> None:
    assert 0 <= done <= total


def test_shifting_moves_by_whole_pixels_exactly_and_smooth_pictures_nearly() -> None:
    x = np.arange(40, dtype=np.float32)
    image = np.stack([np.tile(np.sin(x / 6), (8, 1))] * 3, axis=-1)
    np.testing.assert_array_equal(shift_image(image, 3.0, 1)[:, 3:], image[:, :-3])
    np.testing.assert_array_equal(shift_image(image, -2.0, 0), image)
    wanted = np.sin((x - 2.3) / 6)
    np.testing.assert_allclose(shift_image(image, 2.3, 1)[0, 5:-5, 0], wanted[5:-5], atol=1e-3)


def test_sheared_light_is_linear() -> None:
    grey = np.full((6, 7, 3), 0.5, np.float32)
    np.testing.assert_allclose(shear_light(grey, (0.4, -1.7)), ((0.5 + 0.055) / 1.055) ** 2.4, rtol=1e-5)


def test_the_best_picture_without_depth_is_the_photo(scene: BenchScene) -> None:
    flat = replace(scene, disparity=np.zeros_like(scene.disparity))
    for picture in best_pictures(flat, [Optics(aperture_diameter=4.0), Optics(eye=BETWEEN)]):
        assert psnr(picture, scene.photo) > 50


def test_the_best_picture_through_a_pinhole_is_the_view_there(scene: BenchScene) -> None:
    (picture,) = best_pictures(scene, [Optics(eye=ViewOffset(1.0, -1.0))])
    assert psnr(picture, view_of_square(ViewOffset(1.0, -1.0))) > 40


def test_what_is_in_focus_is_sharp_in_the_best_picture(scene: BenchScene) -> None:
    (picture,) = best_pictures(scene, [Optics(focus_disparity=2.0, aperture_diameter=4.0)])
    inside = scene.disparity == 2.0
    away = np.abs(picture - scene.photo).max(axis=-1)
    sharp, blurred = np.median(away[inside]), np.median(away[~inside])
    assert 3 * sharp < blurred, (sharp, blurred)
    assert sharp < 0.005


def test_every_way_to_draw_is_measured(scene: BenchScene, gl: GLContext) -> None:
    refocused, between = measure_drawing(gl, scene, 1, quiet)
    for figures, variants in ((refocused, APERTURE_VARIANTS), (between, PINHOLE_VARIANTS)):
        assert [drawn.name for drawn in figures.drawn] == [variant.name for variant in variants]
        assert figures.drawn[0].ratio == 1
        assert all(drawn.cost.wall_s > 0 and 15 < drawn.psnr_db < 100 for drawn in figures.drawn)
        assert figures.front
    by_name = {drawn.name: drawn.psnr_db for drawn in between.drawn}
    assert by_name["plain blending, no disparity"] < by_name["at once"] - 3
    samples = {drawn.name: drawn.samples for drawn in refocused.drawn}
    # Samples this near to each other converge in one pass.
    assert samples["every 2nd sample across and down"] < samples["at once"] == samples["until converged"]
