"""The renderer's bench: its best picture against slow twins, and figures of a small field."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.harness.bench_scenes import BenchScene
from benchmarks.refocus import APERTURE_VARIANTS, PINHOLE_VARIANTS, PLAIN, best_pictures, is_stored, measure_drawing
from iibr_core.evaluation.metrics import psnr
from iibr_core.rendering.optics import Optics
from iibr_core.types import ViewOffset
from tests.iibr_core.known_scenes import disparity_of_square, offsets_of, view_of_square
from viewer.gpu.context import GLContext


@pytest.fixture(scope="module")
def scene() -> BenchScene:
    field = tuple(offsets_of(5, 5).values())
    return BenchScene("square", view_of_square(ViewOffset(0.0, 0.0)), disparity_of_square(), {}, field)


def inside(image: np.ndarray, like: np.ndarray) -> np.ndarray:
    """The middle, as large as another."""
    margin = (image.shape[0] - like.shape[0]) // 2
    return image[margin : margin + like.shape[0], margin : margin + like.shape[1]]


def test_the_best_pictures_without_depth_are_the_photo(scene: BenchScene) -> None:
    flat = replace(scene, disparity=np.zeros_like(scene.disparity))
    for picture in best_pictures(flat, Optics(aperture_diameter=4.0)):
        assert psnr(picture, inside(scene.photo, picture)) > 50


def test_the_best_picture_through_a_pinhole_is_the_view_there(scene: BenchScene) -> None:
    _, picture = best_pictures(scene, Optics(aperture_diameter=4.0), ViewOffset(1.0, -1.0))
    assert psnr(picture, view_of_square(ViewOffset(1.0, -1.0))) > 40


def test_what_is_in_focus_is_sharp_in_the_best_picture(scene: BenchScene) -> None:
    picture, _ = best_pictures(scene, Optics(focus_disparity=2.0, aperture_diameter=4.0))
    is_near = inside(scene.disparity, picture) == 2.0
    away = np.abs(picture - inside(scene.photo, picture)).max(axis=-1)
    sharp, blurred = np.median(away[is_near]), np.median(away[~is_near])
    assert 3 * sharp < blurred, (sharp, blurred)
    assert sharp < 0.005


def test_every_way_to_draw_is_measured(scene: BenchScene, gl: GLContext) -> None:
    refocused, between = measure_drawing(gl, scene, 1)
    for figures, variants in ((refocused, APERTURE_VARIANTS), (between, PINHOLE_VARIANTS)):
        assert [drawn.name for drawn in figures.measured] == [variant.name for variant in variants]
        assert figures.measured[0].ratio == 1
        assert all(drawn.cost.wall_s > 0 and 15 < drawn.psnr_db < 100 for drawn in figures.measured)
        assert figures.front
    by_name = {drawn.name: drawn.psnr_db for drawn in between.measured}
    assert by_name["views without disparity"] < by_name["at once"] - 3
    by_name = {drawn.name: drawn.psnr_db for drawn in refocused.measured}
    assert by_name[PLAIN] > by_name["every 2nd view stored"] - 3
    samples = {drawn.name: drawn.samples for drawn in refocused.measured}
    # Samples this near to each other converge in one pass.
    assert samples["every 2nd sample across and down"] < samples["at once"] == samples["until converged"]


def test_views_are_left_out_of_a_field(scene: BenchScene) -> None:
    counts = [sum(is_stored(at, scene.reach, every) for at in scene.field) for every in (1, 2, 0)]
    assert counts == [25, 9, 5]
